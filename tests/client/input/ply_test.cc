#include <algorithm>
#include <cstring>

#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

using testing::ElementsAre;

constexpr char kVertex[] =
    "element vertex 2\nproperty float x\nproperty double y\nproperty float z\n"
    "property int id\nproperty float vx\nproperty float vy\n";

template <typename T>
std::string Number(T value, bool big_endian) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (big_endian) std::reverse(raw, raw + sizeof(T));
  return std::string(raw, sizeof(T));
}

// A binary file with a list before the vertices and a face behind them.
std::string Binary(bool big_endian) {
  const auto row = [&](float x, double y, std::int32_t id) {
    return Number(x, big_endian) + Number(y, big_endian) + Number(0.0F, big_endian) +
           Number(id, big_endian) + Number(x + 1, big_endian) + Number(-x, big_endian);
  };
  return std::string("ply\nformat ") + (big_endian ? "binary_big_endian" : "binary_little_endian") +
         " 1.0\ncomment time 0.5\nelement camera 2\nproperty list ushort short view\n"
         "property uchar kind\n" +
         kVertex + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
         Number<std::uint16_t>(1, big_endian) + "ab" + "c" + Number<std::uint16_t>(0, big_endian) +
         "d" + row(1, 2, 7) + row(3, 4, 9) + std::string(13, '\0');
}

TEST(Ply, TextAndBothByteOrdersReadTheSame) {
  const support::TemporaryFolder directory;
  const std::string text = std::string(
                               "ply\nformat ascii 1.0\ncomment time 0.5\nelement camera 1\n"
                               "property list uchar int view\n") +
                           kVertex + "end_header\n2 5 6\n1 2 0 7 2 -1\n3 4 0 9 4 -3\n";
  for (const std::string& content : {text, Binary(false), Binary(true)}) {
    const RecordedFrame frame = ReadOne(directory.Write("a.ply", content));
    EXPECT_THAT(frame.positions, ElementsAre(1, 2, 3, 4));
    EXPECT_THAT(frame.velocities, ElementsAre(2, -1, 4, -3));
    EXPECT_THAT(frame.ids, ElementsAre(7, 9));
    EXPECT_EQ(frame.time, 0.5);
  }
}

TEST(Ply, TruncatedFilesAreRefused) {
  const support::TemporaryFolder directory;
  const std::string whole = Binary(false);
  for (std::size_t size = 4; size < whole.size() - 13; ++size) {
    ExpectRefused(ReadAll(directory.Write("a.ply", whole.substr(0, size))).status,
                  absl::StatusCode::kDataLoss, {"a.ply"});
  }
}

TEST(Ply, BrokenHeadersAndDeclaredCountsAreRefused) {
  const support::TemporaryFolder directory;
  const auto refusal = [&](const std::string& header) {
    return ReadAll(directory.Write("a.ply", "ply\n" + header + "end_header\n")).status;
  };
  const std::string format = "format binary_little_endian 1.0\n";
  ExpectRefused(refusal(""), absl::StatusCode::kDataLoss, {"a.ply:2", "format"});
  ExpectRefused(refusal("format base64 1.0\n"), absl::StatusCode::kDataLoss, {"a.ply:2"});
  ExpectRefused(refusal(format + "property float x\n"), absl::StatusCode::kDataLoss, {"a.ply:3"});
  ExpectRefused(refusal(format + "element vertex -1\n"), absl::StatusCode::kDataLoss, {"a.ply:3"});
  ExpectRefused(refusal(format + "element vertex 1\nproperty half x\n"),
                absl::StatusCode::kDataLoss, {"a.ply:4"});
  ExpectRefused(refusal(format), absl::StatusCode::kFailedPrecondition, {"no element vertex"});
  const std::string xy = "property float x\nproperty float y\n";
  ExpectRefused(refusal(format + "element vertex 18446744073709551615\n" + xy),
                absl::StatusCode::kDataLoss, {"at most 67108864"});
  ExpectRefused(refusal(format + "element vertex 60000000\n" + xy), absl::StatusCode::kDataLoss,
                {"after 0 of 60000000"});
  ExpectRefused(refusal(format + "element vertex 1\nproperty list uchar float x\n"),
                absl::StatusCode::kDataLoss, {"lists"});
}

}  // namespace
}  // namespace partiemc::client
