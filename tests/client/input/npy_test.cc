#include <zlib.h>

#include <algorithm>
#include <cstring>

#include "client/input/deflated.h"
#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

template <typename T>
std::string Bytes(const std::vector<T>& values, bool big_endian = false) {
  std::string bytes;
  for (const T value : values) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big_endian) std::reverse(raw, raw + sizeof(T));
    bytes.append(raw, sizeof(T));
  }
  return bytes;
}

std::string LittleEndian(std::uint64_t value, int size) {
  std::string bytes;
  for (int k = 0; k < size; ++k) bytes.push_back(static_cast<char>(value >> (8 * k)));
  return bytes;
}

std::string Npy(const std::string& descr, const std::string& shape, const std::string& elements,
                bool fortran = false, char version = 1) {
  const std::string header = "{'descr': " + descr +
                             ", 'fortran_order': " + (fortran ? "True" : "False") +
                             ", 'shape': " + shape + ", }\n";
  return std::string("\x93NUMPY") + version + '\0' +
         LittleEndian(header.size(), version == 1 ? 2 : 4) + header + elements;
}

struct Entry {
  std::string name;
  std::string content;
  bool deflate = false;
  std::string surplus = {};  // After the compressed content, whose size is in the directory.
};

std::string Zip(const std::vector<Entry>& entries) {
  std::string zip;
  std::string directory;
  for (const Entry& entry : entries) {
    const std::string data =
        (entry.deflate ? Deflated(entry.content, Wrapping::kNone) : entry.content) + entry.surplus;
    const auto crc = crc32(0, reinterpret_cast<const Bytef*>(entry.content.data()),
                           static_cast<uInt>(entry.content.size()));
    const std::string common = LittleEndian(20, 2) + LittleEndian(0, 2) +
                               LittleEndian(entry.deflate ? 8 : 0, 2) + LittleEndian(0, 4) +
                               LittleEndian(crc, 4) + LittleEndian(data.size(), 4) +
                               LittleEndian(entry.content.size(), 4) +
                               LittleEndian(entry.name.size(), 2) + LittleEndian(0, 2);
    directory += "PK\x01\x02" + LittleEndian(20, 2) + common + std::string(10, '\0') +
                 LittleEndian(zip.size(), 4) + entry.name;
    zip += "PK\x03\x04" + common + entry.name + data;
  }
  return zip + directory + "PK\x05\x06" + LittleEndian(0, 4) + LittleEndian(entries.size(), 2) +
         LittleEndian(entries.size(), 2) + LittleEndian(directory.size(), 4) +
         LittleEndian(zip.size(), 4) + LittleEndian(0, 2);
}

const std::vector<double> kPositions = {1.5, -2, 3, 4.25};

TEST(Npy, EveryLayoutOfTheSamePositionsReadsTheSame) {
  const std::vector<float> narrow(kPositions.begin(), kPositions.end());
  const std::vector<double> by_column = {1.5, 3, -2, 4.25};
  const std::vector<double> flat = {1.5, -2, 7, 3, 4.25, 7};
  const support::TemporaryFolder directory;
  for (const std::string& content :
       {Npy("'<f8'", "(2, 2)", Bytes(kPositions)), Npy("'>f8'", "(2, 2)", Bytes(kPositions, true)),
        Npy("'<f4'", "(2, 2)", Bytes(narrow)), Npy("'>f4'", "(2, 2)", Bytes(narrow, true)),
        Npy("'<f8'", "(2, 2)", Bytes(by_column), true), Npy("'<f8'", "(2, 3)", Bytes(flat)),
        Npy("'<f8'", "(2, 2)", Bytes(kPositions), false, 2)}) {
    const RecordedFrame frame = ReadOne(directory.Write("pos.npy", content));
    EXPECT_THAT(frame.positions, testing::ElementsAreArray(kPositions));
    EXPECT_EQ(frame.float32, content.find("f4") != std::string::npos);
  }
}

TEST(Npy, AnArrayWithoutRowsIsAFrameWithoutParticles) {
  const support::TemporaryFolder directory;
  EXPECT_EQ(ReadOne(directory.Write("pos.npy", Npy("'<f8'", "(0, 2)", ""))).ParticleCount(), 0u);
}

TEST(Npy, MoreColumnsAreNamedInTheirOrder) {
  const support::TemporaryFolder directory;
  const std::string path =
      directory.Write("pos.npy", Npy("'<f8'", "(1, 4)", Bytes<double>({5, 1, 2, 9})));
  ExpectRefused(ReadAll(path).status, absl::StatusCode::kFailedPrecondition,
                {"4 columns", "--columns"});
  const RecordedFrame frame = ReadOne(path, {.columns = "id,x,y"});
  EXPECT_THAT(frame.positions, ElementsAre(1, 2));
  EXPECT_THAT(frame.ids, ElementsAre(5));
}

TEST(Npy, WhatIsNoTableOfNumbersIsRefused) {
  const support::TemporaryFolder directory;
  const auto refusal = [&](const std::string& content) {
    return ReadAll(directory.Write("pos.npy", content)).status;
  };
  ExpectRefused(refusal(Npy("'|O'", "(2,)", "pickle")), absl::StatusCode::kUnimplemented,
                {"pickled Python objects", "numpy.savez"});
  ExpectRefused(refusal(Npy("[('x', '<f8')]", "(2,)", Bytes(kPositions).substr(16))),
                absl::StatusCode::kFailedPrecondition, {"no position columns", "x"});
  ExpectRefused(refusal(Npy("[('a', [('x', '<f8')])]", "(2,)", "")),
                absl::StatusCode::kUnimplemented, {"nested"});
  ExpectRefused(refusal(Npy("[('a', '<U5')]", "(2,)", "")), absl::StatusCode::kUnimplemented,
                {"without a field of numbers"});
  ExpectRefused(refusal(Npy("'<c16'", "(2, 2)", "")), absl::StatusCode::kUnimplemented, {"c16"});
  ExpectRefused(refusal(Npy("'<f8'", "(5, 2, 2, 2)", "")), absl::StatusCode::kFailedPrecondition,
                {"(5, 2, 2, 2)", "one frame per file", "(frames, N, 2)"});
  ExpectRefused(refusal(Npy("'<f8'", "(4,)", "")), absl::StatusCode::kFailedPrecondition, {"(4)"});
}

TEST(Npy, FieldsOfAStructuredArrayAreColumns) {
  const support::TemporaryFolder directory;
  // Two particles with id, text, two positions, and padding to 16 bytes.
  const std::string elements = Bytes<std::int32_t>({7}) + "ab" + Bytes<float>({1.5, -2}) +
                               std::string(2, '\0') + Bytes<std::int32_t>({9}) + "cd" +
                               Bytes<float>({3, 4.25}) + std::string(2, '\0');
  const std::string descr = "[('id', '<i4'), ('name', '|S2'), ('pos', '<f4', (2,)), ('', '|V2')]";
  const RecordedFrame frame = ReadOne(directory.Write("a.npy", Npy(descr, "(2,)", elements)));
  EXPECT_THAT(frame.positions, testing::ElementsAreArray(kPositions));
  EXPECT_THAT(frame.ids, ElementsAre(7, 9));
  EXPECT_TRUE(frame.float32);
  const ReadSequence frames = ReadAll(directory.Write("b.npy", Npy(descr, "(2, 1)", elements)));
  ASSERT_EQ(frames.frames.size(), 2u) << frames.status;
  EXPECT_THAT(frames.frames[1].ids, ElementsAre(9));
}

TEST(Npy, FieldsCanHaveTheNamesOfKeysOfTheHeader) {
  const support::TemporaryFolder directory;
  const std::string type =
      "[('shape', '<i4'), ('descr', '<i4'), ('fortran_order', 'S4'), (\"it's\", '<i4'), ('x', "
      "'<f8'), ('y', '<f8')]";
  const std::string row(16, '\1');
  const std::string one = row + Bytes<double>({1, 2}), two = row + Bytes<double>({3, 4});
  const std::string table = directory.Write("a.npy", Npy(type, "(2,)", one + two));
  EXPECT_THAT(ReadOne(table).positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(ReadOne(table, {.attributes = {"it's"}}).attributes[0].values,
              ElementsAre(0x1010101, 0x1010101));
  EXPECT_EQ(ReadAll(directory.Write("a.npy", Npy(type, "(2, 1)", one + two))).frames.size(), 2u);
}

TEST(Npy, FramesAreCountedBehindALongHeader) {
  const support::TemporaryFolder directory;
  std::string type = "[('x', '<f8'), ('y', '<f8')";
  for (int k = 0; k < 500; ++k)
    type += ", ('a_long_name_of_a_field_" + std::to_string(k) + "', 'S0')";
  const ReadSequence read =
      ReadAll(directory.Write("a.npy", Npy(type + "]", "(2, 1)", Bytes<double>({1, 2, 3, 4}))));
  ASSERT_EQ(read.frames.size(), 2u) << read.status;
  EXPECT_EQ(read.frame_count, 2u);
  EXPECT_THAT(read.frames[1].positions, ElementsAre(3, 4));
}

TEST(Npy, AnArrayOfThreeExtentsHoldsFrames) {
  const support::TemporaryFolder directory;
  const std::vector<double> planes = {1, 2, 0, 3, 4, 0, 5, 6, 0, 7, 8, 0};
  const std::string path = directory.Write("a.npy", Npy("'<f8'", "(2, 2, 3)", Bytes(planes)));
  const ReadSequence read = ReadAll(path);
  ASSERT_TRUE(read.status.ok()) << read.status;
  ASSERT_EQ(read.frames.size(), 2u);
  EXPECT_EQ(read.frame_count, 2u);
  EXPECT_THAT(read.frames[0].positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(read.frames[1].positions, ElementsAre(5, 6, 7, 8));
  EXPECT_THAT(read.frames[1].source, testing::EndsWith("a.npy, frame 1"));
  const ReadSequence second = ReadAll(path, {.frames = "1"});
  ASSERT_EQ(second.frames.size(), 1u) << second.status;
  EXPECT_THAT(second.frames[0].positions, ElementsAre(5, 6, 7, 8));
}

TEST(Npy, FramesThatAreCutOffOrDeclaredOnlyAreRefused) {
  const support::TemporaryFolder directory;
  const auto read = [&](const std::string& shape, bool fortran = false) {
    return ReadAll(directory.Write("a.npy", Npy("'<f8'", shape, Bytes(kPositions), fortran)));
  };
  const ReadSequence cut = read("(3, 1, 2)");
  EXPECT_EQ(cut.frames.size(), 2u);
  ExpectRefused(cut.status, absl::StatusCode::kDataLoss, {"a.npy, frame 2", "0 of 16 bytes"});
  ExpectRefused(read("(1, 1, 2)").status, absl::StatusCode::kDataLoss, {"frame 0", "behind"});
  ExpectRefused(read("(0, 1, 2)").status, absl::StatusCode::kDataLoss, {"holds no frame"});
  ExpectRefused(read("(4294967296, 0, 2)").status, absl::StatusCode::kDataLoss, {"at most 65536"});
  ExpectRefused(read("(2, 4294967296, 2)").status, absl::StatusCode::kDataLoss, {"4 GiB"});
  ExpectRefused(read("(2, 1, 2)", true).status, absl::StatusCode::kUnimplemented, {"Fortran"});
}

TEST(Npy, DamageAndDeclaredSizesAreFoundOut) {
  const support::TemporaryFolder directory;
  const std::string whole = Npy("'<f8'", "(2, 2)", Bytes(kPositions));
  for (std::size_t size = 6; size < whole.size(); ++size) {
    const absl::Status status = ReadAll(directory.Write("pos.npy", whole.substr(0, size))).status;
    ExpectRefused(status, absl::StatusCode::kDataLoss, {"pos.npy"});
  }
  const auto refusal = [&](const std::string& shape) {
    return ReadAll(directory.Write("pos.npy", Npy("'<f8'", shape, Bytes(kPositions)))).status;
  };
  ExpectRefused(refusal("(4294967296, 4294967296)"), absl::StatusCode::kDataLoss, {"4 GiB"});
  ExpectRefused(refusal("(99999999999999999999999, 2)"), absl::StatusCode::kDataLoss, {"shape"});
  ExpectRefused(refusal("(67108864, 2)"), absl::StatusCode::kDataLoss, {"32 of 1073741824 bytes"});
  ExpectRefused(refusal("(67108865, 2)"), absl::StatusCode::kDataLoss,
                {"67108865 particles; at most 67108864"});
  ExpectRefused(refusal("(-1, 2)"), absl::StatusCode::kDataLoss, {"shape"});
  ExpectRefused(refusal("2"), absl::StatusCode::kDataLoss, {"shape"});
}

TEST(Npy, RefusesBytesBehindTheArray) {
  const support::TemporaryFolder directory;
  const std::string one = Npy("'<f8'", "(2, 2)", Bytes(kPositions));
  for (const std::string& surplus : {std::string("\n"), one}) {
    ExpectRefused(ReadAll(directory.Write("pos.npy", one + surplus)).status,
                  absl::StatusCode::kDataLoss, {"pos.npy", "behind the 32 of the array"});
  }
}

TEST(Npz, NamedArraysAreRecognisedStoredAndDeflated) {
  const support::TemporaryFolder directory;
  for (const bool deflate : {false, true}) {
    const RecordedFrame frame = ReadOne(directory.Write(
        "frame.npz",
        Zip({{"pos.npy", Npy("'<f8'", "(2, 2)", Bytes(kPositions)), deflate},
             {"vel.npy", Npy("'<f4'", "(2, 2)", Bytes<float>({1, 2, 3, 4})), deflate},
             {"id.npy", Npy("'<i8'", "(2,)", Bytes<std::int64_t>({1LL << 60, 7})), deflate},
             {"t.npy", Npy("'<f8'", "()", Bytes<double>({0.5})), deflate}})));
    EXPECT_THAT(frame.positions, testing::ElementsAreArray(kPositions));
    EXPECT_THAT(frame.velocities, ElementsAre(1, 2, 3, 4));
    EXPECT_THAT(frame.ids, ElementsAre(1ULL << 60, 7));
    EXPECT_EQ(frame.time, 0.5);
  }
}

TEST(Npz, SeparateAxesAreRecognisedAndOthersChosen) {
  const support::TemporaryFolder directory;
  const std::string path = directory.Write(
      "frame.npz", Zip({{"x.npy", Npy("'<f4'", "(2,)", Bytes<float>({1, 3})), false},
                        {"y.npy", Npy("'<f4'", "(2,)", Bytes<float>({2, 4})), false},
                        {"type.npy", Npy("'|u1'", "(2,)", std::string("\x01\x02")), false},
                        {"area.npy", Npy("'<f8'", "(1,)", Bytes<double>({9})), false},
                        {"where.npy", Npy("'<f8'", "(2, 2)", Bytes(kPositions)), false}}));
  EXPECT_THAT(ReadOne(path).positions, ElementsAre(1, 2, 3, 4));
  EXPECT_TRUE(ReadOne(path).float32);
  EXPECT_THAT(ReadOne(path).volumes, IsEmpty()) << "an array of another length is no property";
  EXPECT_THAT(ReadOne(path, {.select = {"type=2"}}).positions, ElementsAre(3, 4));
  EXPECT_THAT(ReadOne(path, {.columns = "where"}).positions, testing::ElementsAreArray(kPositions));
  ExpectRefused(ReadAll(path, {.select = {"type=fluid"}}).status,
                absl::StatusCode::kFailedPrecondition, {"type=fluid", "numbers"});
}

TEST(Npz, CountsParticlesBeforeItReadsThem) {
  const support::TemporaryFolder directory;
  const std::string content = Zip({{"pos.npy", Npy("'<f4'", "(67108865, 2)", "")}});
  ExpectRefused(ReadAll(directory.Write("frame.npz", content)).status, absl::StatusCode::kDataLoss,
                {"frame.npz", "67108865 particles; at most 67108864"});
}

TEST(Npz, RefusesSurplusData) {
  const support::TemporaryFolder directory;
  const auto refusal = [&](const std::string& archive) {
    return ReadAll(directory.Write("frame.npz", archive)).status;
  };
  const std::string array = Npy("'<f8'", "(2, 2)", Bytes(kPositions));
  for (const bool deflate : {false, true}) {
    ExpectRefused(refusal(Zip({{"pos.npy", array + "surplus", deflate}})),
                  absl::StatusCode::kDataLoss, {"frame.npz", "pos", "behind the 32 of the array"});
    ExpectRefused(refusal(Zip({{"pos.npy", array, deflate, "surplus"}})),
                  absl::StatusCode::kDataLoss, {"frame.npz", "pos", "damaged"});
    const std::string whole = Zip({{"pos.npy", array, deflate}});
    EXPECT_TRUE(refusal(whole).ok());
    ExpectRefused(refusal(whole + "surplus"), absl::StatusCode::kDataLoss,
                  {"frame.npz", "behind its directory"});
  }
}

TEST(Npz, PickledObjectsAreRefusedWithTheWayOut) {
  const support::TemporaryFolder directory;
  const std::string path = directory.Write(
      "frame.npz", Zip({{"version.npy", Npy("'<i8'", "()", Bytes<std::int64_t>({2})), false},
                        {"particles.npy", Npy("'|O'", "()", "pickle"), false}}));
  ExpectRefused(ReadAll(path).status, absl::StatusCode::kUnimplemented,
                {"particles", "pickled Python objects", "numpy.savez"});
}

TEST(Npz, EveryFlippedOrMissingByteIsAnErrorOrHarmlessAndNeverACrash) {
  const support::TemporaryFolder directory;
  const std::string whole = Zip({{"pos.npy", Npy("'<f8'", "(2, 2)", Bytes(kPositions)), true}});
  for (std::size_t at = 4; at < whole.size(); ++at) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 0xFF);
    const ReadSequence read = ReadAll(directory.Write("a.npz", flipped));
    if (read.status.ok()) {
      ASSERT_EQ(read.frames.size(), 1u) << at;
      EXPECT_THAT(read.frames[0].positions, testing::ElementsAreArray(kPositions)) << at;
    }
    EXPECT_FALSE(ReadAll(directory.Write("b.npz", whole.substr(0, at))).status.ok()) << at;
  }
}

}  // namespace
}  // namespace partiemc::client
