#include "client/recording/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "client/recording/block.h"
#include "support/temporary_folder.h"

namespace partiemc::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr unsigned kSeed = 20240229;

class Recording : public ::testing::Test {
 protected:
  std::string Path(const std::string& name = "test.pemc") const { return directory_.Path(name); }

  support::TemporaryFolder directory_;
};

// Frames of different sizes, one of them empty; every second one has no volumes.
std::vector<RecordedFrame> RandomFrames(std::size_t count) {
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<float> coordinate(-4, 4);
  std::vector<RecordedFrame> frames(count);
  for (std::size_t k = 0; k < count; ++k) {
    RecordedFrame& frame = frames[k];
    frame.index = k;
    frame.time = 0.1 * static_cast<double>(k);
    const std::size_t particles = k == 3 ? 0 : 2 + random() % 5;
    for (std::size_t p = 0; p < particles; ++p) {
      for (int axis = 0; axis < 2; ++axis) {
        frame.positions.push_back(coordinate(random));
        frame.velocities.push_back(coordinate(random));
      }
      frame.ids.push_back((std::uint64_t{random()} << 32) + p);
      if (k % 2 == 0) frame.volumes.push_back(0.5f + std::abs(coordinate(random)));
    }
  }
  return frames;
}

void Write(const std::string& path, const std::vector<RecordedFrame>& frames,
           const RecordingHeader& header = {}, const RecordingOptions& options = {}) {
  const auto writer = RecordingWriter::Create(path, header, options);
  ASSERT_TRUE(writer.ok()) << writer.status();
  for (const RecordedFrame& frame : frames) {
    const absl::Status added = (*writer)->Add(frame);
    ASSERT_TRUE(added.ok()) << added;
  }
  const absl::Status finished = (*writer)->Finish();
  ASSERT_TRUE(finished.ok()) << finished;
}

struct WhatWasRead {
  std::vector<RecordedFrame> frames;
  absl::Status status;
  std::vector<std::string> notices;
};

WhatWasRead Read(const std::string& path, const std::string& range = "") {
  WhatWasRead read;
  const auto reader = RecordingReader::Open(path, range);
  if (!reader.ok()) {
    read.status = reader.status();
    return read;
  }
  RecordedFrame frame;
  auto more = (*reader)->Next(frame);
  for (; more.ok() && *more; more = (*reader)->Next(frame)) read.frames.push_back(frame);
  read.status = more.status();
  read.notices = (*reader)->notices();
  return read;
}

bool SameBits(const RecordedFrame& a, const RecordedFrame& b) {
  if (a.positions.size() != b.positions.size()) return false;
  for (std::size_t k = 0; k < a.positions.size(); ++k) {
    const auto a_bits = std::bit_cast<std::uint64_t>(a.positions[k]);
    if (a_bits != std::bit_cast<std::uint64_t>(b.positions[k])) return false;
  }
  return a.time == b.time && a.ids == b.ids && a.volumes == b.volumes &&
         a.velocities == b.velocities;
}

void ExpectPrefix(const std::vector<RecordedFrame>& read,
                  const std::vector<RecordedFrame>& written) {
  ASSERT_LE(read.size(), written.size());
  for (std::size_t k = 0; k < read.size(); ++k) {
    EXPECT_EQ(read[k].index, k);
    EXPECT_TRUE(SameBits(read[k], written[k])) << "frame " << k;
  }
}

std::string Bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST_F(Recording, KeepsThreeCoordinates) {
  for (const bool float64 : {false, true}) {
    RecordedFrame frame;
    frame.components = 3;
    frame.time = 0.5;
    frame.positions = {1, 2, 3, 4, 5, 6};
    frame.velocities = {1, 0, 0, 0, 1, 0};
    Write(Path(), {frame}, {}, {.float64 = float64});
    const auto reader = RecordingReader::Open(Path(), "", /*in_space=*/true);
    ASSERT_TRUE(reader.ok()) << reader.status();
    RecordedFrame read;
    ASSERT_TRUE(*(*reader)->Next(read));
    EXPECT_EQ(read.components, 3);
    EXPECT_EQ(read.float32, !float64);
    EXPECT_TRUE(SameBits(read, frame));
    const WhatWasRead flat = Read(Path());
    EXPECT_EQ(flat.status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(flat.status.message()), HasSubstr("frame 0 has three coordinates"));
  }
}

TEST_F(Recording, GivesBackEveryBitOfFloat32Frames) {
  const auto frames = RandomFrames(30);
  Write(Path(), frames, {.spacing = 0.25, .title = "a test"});
  const auto reader = RecordingReader::Open(Path(), "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ((*reader)->header().spacing, 0.25);
  EXPECT_EQ((*reader)->header().title, "a test");
  EXPECT_EQ((*reader)->FrameCount(), 30);
  const WhatWasRead read = Read(Path());
  EXPECT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.notices, IsEmpty());
  ASSERT_THAT(read.frames, SizeIs(30));
  ExpectPrefix(read.frames, frames);
  EXPECT_TRUE(read.frames[0].float32);
}

TEST_F(Recording, GivesBackEveryBitOfFloat64FramesWhenAskedTo) {
  auto frames = RandomFrames(3);
  frames[0].positions = {1e6 + 1e-9, 0.1, -1.0 / 3, 5e-324};
  frames[0].ids.clear();
  frames[0].volumes.clear();
  frames[0].velocities.clear();
  Write(Path(), frames, {}, {.float64 = true});
  const WhatWasRead read = Read(Path());
  ASSERT_THAT(read.frames, SizeIs(3));
  ExpectPrefix(read.frames, frames);
  EXPECT_FALSE(read.frames[0].float32);
}

TEST_F(Recording, LeavesOutVelocitiesThatTellNothing) {
  auto frames = RandomFrames(3);
  frames[0].time.reset();
  frames[1].velocities[1] = std::numeric_limits<float>::quiet_NaN();
  Write(Path(), frames);
  const WhatWasRead read = Read(Path());
  EXPECT_TRUE(read.status.ok()) << read.status;
  ASSERT_THAT(read.frames, SizeIs(3));
  EXPECT_THAT(read.frames[0].velocities, IsEmpty());
  EXPECT_THAT(read.frames[1].velocities, IsEmpty());
  EXPECT_EQ(read.frames[1].positions.size(), frames[1].positions.size());
  EXPECT_EQ(read.frames[2].velocities, frames[2].velocities);
}

TEST_F(Recording, KeepsWhatIsNotFinite) {
  auto frames = RandomFrames(1);
  frames[0].positions[0] = std::numeric_limits<float>::quiet_NaN();
  frames[0].positions[1] = -std::numeric_limits<double>::infinity();
  Write(Path(), frames);
  const WhatWasRead read = Read(Path());
  ASSERT_THAT(read.frames, SizeIs(1));
  EXPECT_TRUE(std::isnan(read.frames[0].positions[0]));
  EXPECT_EQ(read.frames[0].positions[1], -std::numeric_limits<double>::infinity());
}

TEST_F(Recording, RefusesFloat32WhereItWouldMoveAParticleVisibly) {
  const auto writer = RecordingWriter::Create(Path(), {.spacing = 0.01}, {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  RecordedFrame frame;
  frame.positions = {0.001, 0.002, 0.011, 0.002};
  EXPECT_TRUE((*writer)->Add(frame).ok());
  for (double& x : frame.positions) x += 1e6;
  const absl::Status status = (*writer)->Add(frame);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--float64"));
}

TEST_F(Recording, WithoutFramesIsARecordingToo) {
  Write(Path(), {});
  const WhatWasRead read = Read(Path());
  EXPECT_TRUE(read.status.ok()) << read.status;
  EXPECT_THAT(read.frames, IsEmpty());
  EXPECT_THAT(read.notices, IsEmpty());
}

TEST_F(Recording, DeliversTheFramesOfARangeUnderTheirOwnIndex) {
  const auto frames = RandomFrames(20);
  Write(Path(), frames);
  const WhatWasRead read = Read(Path(), "7:12:2");
  ASSERT_THAT(read.frames, SizeIs(3));
  EXPECT_EQ(read.frames[1].index, 9);
  EXPECT_TRUE(SameBits(read.frames[1], frames[9]));
}

TEST_F(Recording, CutOffAtAnyByteLosesItsTailAndNothingElse) {
  const auto frames = RandomFrames(20);
  Write(Path(), frames);
  const std::string whole = Bytes(Path());
  std::size_t most = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    SCOPED_TRACE(size);
    WriteBytes(Path("cut.pemc"), whole.substr(0, size));
    const WhatWasRead read = Read(Path("cut.pemc"));
    ExpectPrefix(read.frames, frames);
    EXPECT_GE(read.frames.size(), most) << "a longer file must not give less";
    most = read.frames.size();
    if (read.status.ok()) {
      ASSERT_THAT(read.notices, SizeIs(1));
      EXPECT_THAT(read.notices[0],
                  HasSubstr("truncated after " + std::to_string(most) + " frames"));
    } else {
      EXPECT_THAT(read.frames, IsEmpty()) << "only a file without its header is refused";
      EXPECT_EQ(read.status.code(), absl::StatusCode::kDataLoss);
    }
  }
  EXPECT_EQ(most, frames.size()) << "without its last bytes all frames are there";
}

TEST_F(Recording, ADamagedByteIsNeverDeliveredAsAFrame) {
  const auto frames = RandomFrames(20);
  Write(Path(), frames);
  const std::string whole = Bytes(Path());
  std::size_t errors = 0;
  for (std::size_t place = 0; place < whole.size(); ++place) {
    SCOPED_TRACE(place);
    std::string damaged = whole;
    damaged[place] = static_cast<char>(damaged[place] ^ (1 << place % 8));
    WriteBytes(Path("damaged.pemc"), damaged);
    const WhatWasRead read = Read(Path("damaged.pemc"));
    ExpectPrefix(read.frames, frames);
    if (!read.status.ok()) ++errors;
    // A larger length looks like a truncated file; an unused bit may change nothing.
    EXPECT_TRUE(!read.status.ok() || !read.notices.empty() || read.frames.size() == frames.size());
  }
  EXPECT_GT(errors, whole.size() / 2);
}

// Length-delimited messages as in a block: field 1 of a frame is its number, field 3 its format; an
// absent field 1 is 0.
TEST_F(Recording, AFrameInAnotherFramesPlaceIsDamage) {
  using namespace std::string_literals;
  const std::string header = "\0"s, frame_0 = "\x02\x18\x01"s, frame_1 = "\x04\x08\x01\x18\x01"s;
  const auto frames_of = [&](const std::string& frames) {
    recording::BlockPacker packer(1);
    std::string file = recording::MakeMark(recording::kFileTag, recording::kVersion);
    for (const std::string& block : {header, frames}) file += *packer.Pack(block);
    file += recording::MakeMark(recording::kTailTag, 2);
    std::ofstream(Path(), std::ios::binary) << file;
    return Read(Path());
  };
  EXPECT_THAT(frames_of(frame_0 + frame_1).frames, SizeIs(2));
  for (const std::string& wrong : {frame_0 + frame_0, frame_1 + frame_1, frame_1 + frame_0}) {
    EXPECT_THAT(std::string(frames_of(wrong).status.message()), HasSubstr("stands there"));
  }
}

TEST_F(Recording, RefusesBlocksThatExpandTooMuch) {
  RecordedFrame frame;
  frame.positions.assign(std::size_t{1} << 22, 0.0);
  std::vector<RecordedFrame> frames(6, frame);
  Write(Path(), frames);
  const WhatWasRead read = Read(Path());
  EXPECT_EQ(read.status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(read.status.message()), HasSubstr("--max-expansion"));
  const auto trusting = RecordingReader::Open(Path(), "", false, 1e9);
  ASSERT_TRUE(trusting.ok());
  for (std::size_t k = 0; k < frames.size(); ++k) ASSERT_TRUE(*(*trusting)->Next(frame)) << k;
}

TEST_F(Recording, RefusesABlockOneByteAboveTheLimit) {
  RecordedFrame frame;
  frame.positions.assign(std::size_t{1} << 16, 0.0);
  Write(Path(), {frame});
  // Reads the header and the block of the frame.
  const auto read = [&](std::size_t limit) -> absl::StatusOr<std::size_t> {
    auto reader = recording::BlockReader::Open(Path(), 1e9, limit);
    std::string_view block;
    auto piece = reader->Next(block);
    if (piece.ok()) piece = reader->Next(block);
    if (!piece.ok()) return piece.status();
    return block.size();
  };
  const auto size = read(recording::kMaxBlockBytes);
  ASSERT_TRUE(size.ok()) << size.status();
  EXPECT_EQ(read(*size).value_or(0), *size);
  EXPECT_EQ(read(*size - 1).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(Recording, RefusesToWriteAFrameAboveTheLimits) {
  RecordedFrame frame;
  frame.source = "big.csv";
  frame.positions.assign(2 * 1000, 0.0);
  const auto add = [&](std::size_t max_frame_bytes) {
    const auto writer = RecordingWriter::Create(Path(), {}, {.max_frame_bytes = max_frame_bytes});
    return writer.ok() ? (*writer)->Add(frame) : writer.status();
  };
  EXPECT_TRUE(add(9000).ok());
  const absl::Status refused = add(8000);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("big.csv: has 80"));
  EXPECT_EQ(add(recording::kMaxBlockBytes + 1).code(), absl::StatusCode::kInvalidArgument);
  frame.positions.clear();
  frame.attributes.resize(recording::kMaxAttributes + 1);
  EXPECT_EQ(add(recording::kMaxBlockBytes).code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(Recording, HoldsTheMostAttributesAndReadsNoMore) {
  RecordedFrame frame;
  frame.positions = {1, 2};
  frame.attributes.assign(recording::kMaxAttributes, {"name", 3, {1, 2, 3}});
  Write(Path(), {frame});
  const WhatWasRead most = Read(Path());
  ASSERT_THAT(most.frames, SizeIs(1)) << most.status;
  EXPECT_EQ(most.frames[0].attributes, frame.attributes);

  // A frame of a million empty attributes (field 8 of ParticleFrame).
  recording::BlockPacker packer(1);
  std::string file = recording::MakeMark(recording::kFileTag, recording::kVersion);
  file += *packer.Pack(std::string(1, '\0'));
  std::string block("\x80\x89\x7a", 3);
  for (int k = 0; k < 1'000'000; ++k) block += std::string("\x42\0", 2);
  file += *packer.Pack(block);
  WriteBytes(Path(), file);
  const absl::Status refused = Read(Path()).status;
  EXPECT_EQ(refused.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("fields"));
}

TEST_F(Recording, BytesBehindTheEndAreDamage) {
  Write(Path(), RandomFrames(2));
  WriteBytes(Path(), Bytes(Path()) + "x");
  EXPECT_EQ(Read(Path()).status.code(), absl::StatusCode::kDataLoss);
}

TEST_F(Recording, AnUnfinishedOneLeavesNoFile) {
  {
    const auto writer = RecordingWriter::Create(Path(), {}, {});
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE((*writer)->Add(RandomFrames(1)[0]).ok());
  }
  EXPECT_TRUE(std::filesystem::is_empty(directory_.path()));
}

TEST_F(Recording, IsKnownByItsFirstBytes) {
  Write(Path("other.name"), RandomFrames(1));
  EXPECT_TRUE(IsRecording(Path("other.name")));
  WriteBytes(Path("text.pemc"), "x,y\n0,0\n");
  EXPECT_FALSE(IsRecording(Path("text.pemc")));
  EXPECT_FALSE(IsRecording(Path("missing.pemc")));
  EXPECT_FALSE(IsRecording(directory_.path().string()));
}

TEST_F(Recording, OptionsOutOfRangeAreRefused) {
  EXPECT_EQ(RecordingWriter::Create(Path(), {.spacing = -1}, {}).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(RecordingWriter::Create(Path(), {}, {.compression_level = 20}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(BundledRecording, IsTheDamBreakBelowTwoMegabytes) {
  const std::string path = PARTIEMC_SOURCE_DIR "/client/recordings/dam_break.pemc";
  EXPECT_LT(std::filesystem::file_size(path), 2'000'000);
  const auto reader = RecordingReader::Open(path, "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ((*reader)->header().spacing, 0.0303);
  const WhatWasRead read = Read(path);
  EXPECT_TRUE(read.status.ok()) << read.status;
  ASSERT_THAT(read.frames, SizeIs(75));
  for (const RecordedFrame& frame : read.frames) {
    EXPECT_EQ(frame.ParticleCount(), 2278);
    EXPECT_THAT(frame.ids, SizeIs(2278));
    EXPECT_THAT(frame.velocities, SizeIs(2 * 2278));
  }
  // 34 x 67 particles starting at (0.03, 0.03).
  EXPECT_EQ(read.frames[0].positions[0], 0.03f);
  EXPECT_EQ(read.frames[0].positions[3], 0.060303f);
  EXPECT_EQ(*read.frames[1].time, 0.023347);
}

TEST_F(Recording, AttributesComeBackWithTheirBits) {
  std::vector<RecordedFrame> frames = RandomFrames(3);
  for (RecordedFrame& frame : frames) {
    ParticleAttribute vector{"T", 3, {}}, scalar{"a name, quoted \"so\"", 1, {}};
    for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
      scalar.values.push_back(1.f / static_cast<float>(3 + k));
      for (int c = 0; c < 3; ++c) vector.values.push_back(static_cast<float>(c) - .3f);
    }
    frame.attributes = {vector, scalar};
  }
  frames[1].attributes.clear();
  Write(Path(), frames);
  const auto reader = RecordingReader::Open(Path(), "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  RecordedFrame frame;
  for (const RecordedFrame& expected : frames) {
    ASSERT_TRUE(*(*reader)->Next(frame));
    EXPECT_EQ(frame.attributes, expected.attributes);
  }
}

TEST_F(Recording, AnAttributeOfAnotherLengthIsDamage) {
  std::vector<RecordedFrame> frames = RandomFrames(1);
  frames[0].attributes = {{"p", 1, {1.f}}};
  Write(Path(), frames);
  const auto reader = RecordingReader::Open(Path(), "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  RecordedFrame frame;
  const auto read = (*reader)->Next(frame);
  EXPECT_EQ(read.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(read.status().message()), HasSubstr("a scalar has 4 bytes where"));
}

TEST_F(Recording, HoldsOrthogonalPeriodicBoxes) {
  std::vector<RecordedFrame> frames = RandomFrames(5);
  frames[0].box = RecordedBox{.low = {-1 / 3., 2}, .length = {1e5 / 3, 7}, .is_periodic = {true}};
  frames[1].box =
      RecordedBox{.low = {0, 0, 5}, .length = {1, 2, 3}, .is_periodic = {false, true, true}};
  frames[2].box = RecordedBox{.length = {9, 9}, .is_periodic = {true, true}, .is_tilted = true};
  Write(Path(), frames);
  const WhatWasRead read = Read(Path());
  ASSERT_THAT(read.frames, SizeIs(5)) << read.status;
  ASSERT_TRUE(read.frames[0].box && read.frames[1].box);
  EXPECT_THAT(read.frames[0].box->low, ElementsAre(-1 / 3., 0, 0));
  EXPECT_THAT(read.frames[0].box->length, ElementsAre(1e5 / 3, 0, 0)) << "of periodic axes only";
  EXPECT_THAT(read.frames[1].box->low, ElementsAre(0, 0, 5));
  EXPECT_THAT(read.frames[1].box->is_periodic, ElementsAre(false, true, true));
  EXPECT_FALSE(read.frames[2].box.has_value()) << "triclinic boxes are not stored";
  EXPECT_FALSE(read.frames[3].box.has_value());
}

TEST_F(Recording, AxesWithoutExtentAreNotPeriodic) {
  std::vector<RecordedFrame> frames = RandomFrames(1);
  frames[0].box = RecordedBox{.length = {5, 0, -1}, .is_periodic = {true, true, true}};
  Write(Path(), frames);
  const WhatWasRead read = Read(Path());
  ASSERT_THAT(read.frames, SizeIs(1)) << read.status;
  EXPECT_THAT(read.frames[0].box->is_periodic, ElementsAre(true, false, false));
}

// A frame with the format 1 and a box with the length `length` along x.
TEST_F(Recording, BoxesWithoutALengthAreDamage) {
  using namespace std::string_literals;
  const auto read_box_of = [&](double length) {
    std::string bytes(sizeof(length), '\0');
    std::memcpy(bytes.data(), &length, sizeof(length));
    const std::string box = "\x0a\x09\x11" + bytes;
    const std::string frame = "\x18\x01\x4a" + std::string(1, static_cast<char>(box.size())) + box;
    recording::BlockPacker packer(1);
    std::string file = recording::MakeMark(recording::kFileTag, recording::kVersion);
    file += *packer.Pack("\0"s);
    file += *packer.Pack(std::string(1, static_cast<char>(frame.size())) + frame);
    file += recording::MakeMark(recording::kTailTag, 1);
    std::ofstream(Path(), std::ios::binary) << file;
    return Read(Path());
  };
  const WhatWasRead whole = read_box_of(7);
  ASSERT_THAT(whole.frames, SizeIs(1)) << whole.status;
  EXPECT_EQ(whole.frames[0].box->length[0], 7);
  for (const double length : {0., -1., std::nan(""), HUGE_VAL}) {
    const WhatWasRead read = read_box_of(length);
    EXPECT_EQ(read.status.code(), absl::StatusCode::kDataLoss) << length;
    EXPECT_THAT(std::string(read.status.message()), HasSubstr("length of the box"));
  }
}

}  // namespace
}  // namespace partiemc::client
