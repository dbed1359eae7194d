#include <zstd.h>

#include <algorithm>
#include <set>

#include "client/input/deflated.h"
#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

std::string Dump(int frames) {
  std::string dump;
  for (int frame = 0; frame < frames; ++frame) {
    dump +=
        "ITEM: TIMESTEP\n" + std::to_string(frame) +
        "\nITEM: NUMBER OF ATOMS\n500\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\nITEM: ATOMS x y\n";
    for (int atom = 0; atom < 500; ++atom) {
      dump += std::to_string(atom * 0.37) + " " + std::to_string(atom * frame * 0.11) + "\n";
    }
  }
  return dump;
}

std::string Gzip(const std::string& content) { return Deflated(content, Wrapping::kGzip); }

std::string Zstd(const std::string& content) {
  std::string packed(ZSTD_compressBound(content.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), content.data(), content.size(), 3));
  return packed;
}

class Packed : public testing::TestWithParam<std::string (*)(const std::string&)> {};

TEST_P(Packed, ReadsAsThePlainFileWhateverItsName) {
  const support::TemporaryFolder directory;
  const ReadSequence plain = ReadAll(directory.Write("plain", Dump(80)));
  const ReadSequence packed = ReadAll(directory.Write("packed", GetParam()(Dump(80))));
  ASSERT_TRUE(packed.status.ok()) << packed.status;
  ASSERT_EQ(packed.frames.size(), plain.frames.size());
  for (std::size_t k = 0; k < plain.frames.size(); ++k) {
    ASSERT_EQ(packed.frames[k].positions, plain.frames[k].positions) << k;
  }
}

TEST_P(Packed, PartsThatFollowEachOtherAreOneFile) {
  const support::TemporaryFolder directory;
  const ReadSequence read =
      ReadAll(directory.Write("packed", GetParam()(Dump(3)) + GetParam()(Dump(2))));
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_EQ(read.frames.size(), 5u);
}

TEST_P(Packed, WhatIsCutOffIsSaidAfterTheFramesBefore) {
  const support::TemporaryFolder directory;
  // Larger than a block of each format, so that a part can be unpacked.
  const std::string whole = GetParam()(Dump(200));
  const ReadSequence read = ReadAll(directory.Write("packed", whole.substr(0, whole.size() - 40)));
  EXPECT_GT(read.frames.size(), 10u);
  EXPECT_LT(read.frames.size(), 200u);
  ExpectRefused(read.status, absl::StatusCode::kDataLoss, {"packed", "truncated"});
}

TEST_P(Packed, DamageIsAnError) {
  const support::TemporaryFolder directory;
  std::string whole = GetParam()(Dump(3));
  for (std::size_t k = 20; k < 120; ++k) whole[k] = static_cast<char>(k * 37);
  const ReadSequence read = ReadAll(directory.Write("packed", whole));
  EXPECT_FALSE(read.status.ok());
}

INSTANTIATE_TEST_SUITE_P(Packings, Packed, testing::Values(&Gzip, &Zstd));

// Comments, which are cheap to read.
std::string MostlyComments(std::size_t bytes) {
  const std::string comment = "#" + std::string(4094, '-') + "\n";
  std::string table = "x,y\n";
  while (table.size() < bytes) table += comment;
  return table + "1,2\n";
}

TEST(Packed, RefusesWhatExpandsTooMuch) {
  const support::TemporaryFolder directory;
  const std::string path = directory.Write("bomb.csv.zst", Zstd(MostlyComments(80 << 20)));
  ASSERT_LT(std::filesystem::file_size(path), 80u << 10) << "a thousandth";
  ExpectRefused(ReadAll(path).status, absl::StatusCode::kResourceExhausted,
                {"bomb.csv.zst", "64 MiB and 1000 times its size", "--max-expansion"});
  EXPECT_THAT(ReadOne(path, {.max_expansion = 1e6}).positions, testing::ElementsAre(1, 2));
  const std::string small = directory.Write("small.csv.zst", Zstd(MostlyComments(60 << 20)));
  EXPECT_THAT(ReadOne(small).positions, testing::ElementsAre(1, 2));
}

// Gives a thousand bytes at a time.
class SlowSource final : public input::ByteSource {
 public:
  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override {
    ends.insert(bytes + size);
    const std::size_t count = std::min({size, left, std::size_t{1000}});
    std::fill_n(bytes, count, 'x');
    left -= count;
    return count;
  }

  std::size_t left = 5'000'000;
  std::set<const char*> ends;  // Of the memory that was offered.
};

TEST(ReadUpTo, EnlargesItsMemoryFewTimesForManyReads) {
  SlowSource source;
  std::vector<char> bytes;
  const absl::Status status = input::ReadUpTo(source, std::size_t{1} << 30, bytes);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(bytes, std::vector<char>(5'000'000, 'x'));
  EXPECT_LE(source.ends.size(), 8u);
}

TEST(Packed, TablesMayBePackedToo) {
  const support::TemporaryFolder directory;
  EXPECT_THAT(ReadOne(directory.Write("frame.csv.gz", Gzip("x,y\n1,2\n"))).positions,
              testing::ElementsAre(1, 2));
}

}  // namespace
}  // namespace partiemc::client
