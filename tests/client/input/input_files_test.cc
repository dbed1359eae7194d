#include "client/input/collection.h"
#include "client/input/fixtures.h"
#include "client/input/frame_range.h"

namespace partiemc::client {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::vector<double> FirstCoordinates(const ReadSequence& read) {
  std::vector<double> firsts;
  for (const RecordedFrame& frame : read.frames) firsts.push_back(frame.positions.at(0));
  return firsts;
}

support::TemporaryFolder& WriteFrames(support::TemporaryFolder& directory, const std::string& stem,
                                      int count) {
  for (int k = 0; k < count; ++k) {
    directory.Write(stem + std::to_string(k) + ".csv", "x,y\n" + std::to_string(k) + ",0\n");
  }
  return directory;
}

TEST(InputFiles, ADirectoryIsReadInTheOrderOfItsNumbers) {
  support::TemporaryFolder directory;
  const ReadSequence read = ReadAll(WriteFrames(directory, "frame_", 12).path());
  ASSERT_TRUE(read.status.ok()) << read.status;
  EXPECT_EQ(read.frame_count, 12u);
  EXPECT_EQ(read.description, "12 CSV files, frame_0.csv to frame_11.csv");
  EXPECT_THAT(FirstCoordinates(read), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_EQ(read.frames[10].index, 10u);
}

TEST(InputFiles, SeveralSeriesAreRefusedByNameWithAPatternToUse) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "Water_", 3);
  WriteFrames(directory, "Soil_", 2);
  directory.Write("Wall.csv", "x,y\n1,2\n");
  for (const std::string& input : {directory.path().string(), directory.Path("*.csv")}) {
    ExpectRefused(ReadAll(input).status, absl::StatusCode::kFailedPrecondition,
                  {"3 series", "Soil_*.csv (2 files)", "Wall.csv (1 file)", "Water_*.csv (3 files)",
                   std::string("'") + directory.Path("Water_*.csv") + "'"});
  }
  EXPECT_EQ(ReadAll(directory.Path("Soil_*.csv")).frames.size(), 2u);
}

TEST(InputFiles, RunsThatDifferInAnotherNumberAreSeveralSeries) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "run1_", 2);
  WriteFrames(directory, "run2_", 2);
  ExpectRefused(ReadAll(directory.path()).status, absl::StatusCode::kFailedPrecondition,
                {"run1_*.csv (2 files)", "run2_*.csv (2 files)"});
  EXPECT_EQ(ReadAll(directory.Path("run2_*")).frames.size(), 2u);
  EXPECT_EQ(ReadAll(directory.Path("run*")).frames.size(), 4u);
}

TEST(InputFiles, FilesWithoutPositionsAreSkippedWithANotice) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "frame_", 2);
  directory.Write("energy.csv", "t,kinetic\n0,1\n");
  directory.Write("in.dam", "units lj\ndimension 2\n");
  directory.Write(".hidden.csv", "x,y\n1,2\n");
  const ReadSequence read = ReadAll(directory.path());
  EXPECT_EQ(read.frames.size(), 2u) << read.status;
  EXPECT_EQ(read.notices.size(), 2u);
  EXPECT_THAT(read.notices, Contains(HasSubstr("energy.csv")));
  EXPECT_THAT(read.notices, Contains(HasSubstr("LAMMPS input script")));
}

TEST(InputFiles, TimesBesideTheFramesAreTheirTimes) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "frame_", 3);
  directory.Write("times.csv", "frame,t\n0,0.5\n1,0.75\n");
  for (const std::string& input : {directory.path().string(), directory.Path("frame_*.csv")}) {
    const ReadSequence read = ReadAll(input);
    ASSERT_EQ(read.frames.size(), 2u) << read.status;
    EXPECT_EQ(read.frames[0].time, 0.5);
    EXPECT_EQ(read.frames[1].time, 0.75);
    EXPECT_THAT(read.notices, Contains(HasSubstr("times of the frames from")));
    ExpectRefused(read.status, absl::StatusCode::kFailedPrecondition,
                  {"times.csv", "no time for frame 2", "frame_2.csv"});
  }
}

TEST(InputFiles, ATimesFileMayBeASingleColumn) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "frame_", 2);
  const std::string times = directory.Path("t.txt");
  directory.Write("t.txt", "0.5\n0.75\n");
  const ReadSequence read = ReadAll(directory.Path("frame_*.csv"), {.times = times});
  ASSERT_EQ(read.frames.size(), 2u) << read.status;
  EXPECT_EQ(read.frames[1].time, 0.75);
  directory.Write("t.txt", "0.5\nnan\n");
  ExpectRefused(ReadAll(directory.Path("frame_*.csv"), {.times = times}).status,
                absl::StatusCode::kDataLoss, {"t.txt:2", "time"});
  directory.Write("t.txt", "a,b\n1,2\n");
  ExpectRefused(ReadAll(directory.Path("frame_*.csv"), {.times = times}).status,
                absl::StatusCode::kFailedPrecondition, {"t.txt", "frame,t"});
}

TEST(InputFiles, DecimalTimesInNamesOrderTheFrames) {
  support::TemporaryFolder directory;
  directory.Write("p_0.05.csv", "x,y\n1,0\n");
  directory.Write("p_0.1.csv", "x,y\n2,0\n");
  directory.Write("p_0.15.csv", "x,y\n3,0\n");
  directory.Write("p_0.2.csv", "x,y\n4,0\n");
  const ReadSequence certain = ReadAll(directory.path());
  EXPECT_THAT(FirstCoordinates(certain), ElementsAre(1, 2, 3, 4)) << certain.status;
  EXPECT_TRUE(certain.notices.empty());
  std::filesystem::remove(directory.Path("p_0.05.csv"));
  const ReadSequence uncertain = ReadAll(directory.path());
  EXPECT_THAT(FirstCoordinates(uncertain), ElementsAre(2, 3, 4)) << uncertain.status;
  EXPECT_THAT(uncertain.notices, ElementsAre(HasSubstr("sorted as decimal fractions")));
}

TEST(InputFiles, AFrameWithTwoTimesIsRefused) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "frame_", 2);
  const std::string times = directory.Write("t.csv", "frame,t\n0,0.5\n1,0.75\n0,1\n");
  ExpectRefused(ReadAll(directory.Path("frame_*.csv"), {.times = times}).status,
                absl::StatusCode::kDataLoss, {"t.csv:4", "frame 0 already has a time"});
}

TEST(InputFiles, TimesThatDoNotIncreaseHaveOneNotice) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "frame_", 4);
  const std::string frames = directory.Path("frame_*.csv");
  const std::string times = directory.Write("t.txt", "1\n0.5\n0.25\n2\n");
  const auto is_of_order = HasSubstr("check the");
  EXPECT_THAT(ReadAll(frames, {.times = times}).notices,
              ElementsAre(HasSubstr("times of the frames"),
                          HasSubstr("time goes back at frame 1: 1 then 0.5")));
  directory.Write("t.txt", "1\n2\n2\n1\n");
  EXPECT_THAT(
      ReadAll(frames, {.times = times}).notices,
      ElementsAre(HasSubstr("times of the frames"), HasSubstr("time repeats at frame 2: 2")));
  directory.Write("t.txt", "1\n2\n3\n4\n");
  EXPECT_THAT(ReadAll(frames, {.times = times}).notices, Not(Contains(is_of_order)));
}

TEST(InputFiles, FramesWithoutATimeInTheTimesFileAreRefused) {
  support::TemporaryFolder directory;
  const std::string times = directory.Write("t.csv", "frame,t\n0,0.5\n2,0.75\n");
  std::string dump;
  for (int k = 0; k < 3; ++k) {
    dump += "ITEM: TIMESTEP\n" + std::to_string(1000 * k) +
            "\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\n"
            "ITEM: ATOMS x y\n0 0\n";
  }
  const std::string path = directory.Write("dump.txt", dump);
  ExpectRefused(ReadAll(path, {.times = times}).status, absl::StatusCode::kFailedPrecondition,
                {"t.csv", "no time for frame 1", "timestep 1000", "--frames"});
  const ReadSequence read = ReadAll(path, {.times = times, .frames = "0:3:2"});
  ASSERT_EQ(read.frames.size(), 2u) << read.status;
  EXPECT_EQ(read.frames[1].time, 0.75);
}

TEST(InputFiles, ARangeKeepsTheIndicesOfTheInput) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "frame_", 10);
  const ReadSequence read = ReadAll(directory.path(), {.frames = "2:9:3"});
  EXPECT_EQ(read.frame_count, 3u);
  EXPECT_THAT(FirstCoordinates(read), ElementsAre(2, 5, 8));
  EXPECT_EQ(read.frames.at(1).index, 5u);
  EXPECT_EQ(ReadAll(directory.path(), {.frames = "8:"}).frames.size(), 2u);
  EXPECT_EQ(ReadAll(directory.path(), {.frames = ":3"}).frames.size(), 3u);
  EXPECT_THAT(FirstCoordinates(ReadAll(directory.path(), {.frames = "4"})), ElementsAre(4));
  EXPECT_EQ(ReadAll(directory.path(), {.frames = "20:"}).frames.size(), 0u);
}

TEST(InputFiles, ARangeWithinOneFilePassesOverTheOthers) {
  const support::TemporaryFolder directory;
  std::string dump;
  for (const char* x : {"0", "1", "2", "3"}) {
    dump += std::string("1\nAtoms. Timestep: 0\n1 ") + x + " 0 0\n";
  }
  const ReadSequence read = ReadAll(directory.Write("dump.xyz", dump), {.frames = "1::2"});
  EXPECT_EQ(read.frame_count, 2u);
  EXPECT_THAT(FirstCoordinates(read), ElementsAre(1, 3));
}

// Takes hours if every string searches the blanks at the end.
TEST(InputFiles, ASeriesIsReadInLinearTime) {
  constexpr std::size_t kFiles = 50'000;
  std::string text = "{\"files\" : [";
  for (std::size_t k = 0; k < kFiles; ++k) {
    text += "{\"name\" : \"a.vtp\", \"time\" : " + std::to_string(k) + "},\n";
  }
  text += "]}" + std::string(std::size_t{32} << 20, ' ');
  const support::TemporaryFolder directory;
  const auto collection = input::ReadCollection(directory.Write("a.vtp.series", text));
  ASSERT_TRUE(collection.ok() && collection->has_value()) << collection.status();
  EXPECT_EQ((*collection)->files.size(), kFiles);
}

TEST(InputFiles, WhatIsNoRangeIsRefused) {
  for (const char* text : {":0", "3:3", "5:2", "a:b", "-1:", "1:2:0", "1:2:3:4", "1.5"}) {
    ExpectRefused(input::ParseFrameRange(text).status(), absl::StatusCode::kInvalidArgument,
                  {"--frames", text, "A:B"});
  }
}

TEST(InputFiles, TheCountOfARangeIsTheNumberOfIndicesInIt) {
  for (const char* text : {"", "0:1", "2:", ":5", "1:9:2", "3:7:10", "0::3", "11:"}) {
    const auto range = input::ParseFrameRange(text);
    ASSERT_TRUE(range.ok()) << text;
    for (std::size_t count = 0; count < 12; ++count) {
      std::size_t expected = 0;
      for (std::size_t k = 0; k < count; ++k) expected += range->Contains(k) ? 1 : 0;
      EXPECT_EQ(range->CountOf(count), expected) << text << " of " << count;
    }
  }
}

TEST(InputFiles, WhatIsNotThereIsSaidWithAdvice) {
  const support::TemporaryFolder directory;
  ExpectRefused(ReadAll(directory.Path("none.csv")).status, absl::StatusCode::kNotFound,
                {"none.csv", "check the path"});
  ExpectRefused(ReadAll(directory.Path("*.vtp")).status, absl::StatusCode::kNotFound,
                {"*.vtp", "check the pattern"});
  ExpectRefused(ReadAll(directory.Path("f_{}.ply")).status, absl::StatusCode::kNotFound,
                {"{} is no pattern", "f_*.ply'"});
  std::filesystem::create_directory(directory.Path("run"));
  ExpectRefused(ReadAll(directory.path()).status, absl::StatusCode::kNotFound,
                {"holds no files", "run"});
  directory.Write("notes.md", "# Notes\n");
  ExpectRefused(ReadAll(directory.path()).status, absl::StatusCode::kFailedPrecondition,
                {"no frames that can be read", "notes.md"});
}

TEST(InputFiles, AnErrorInALaterFileComesAfterTheFramesBefore) {
  support::TemporaryFolder directory;
  WriteFrames(directory, "frame_", 4);
  directory.Write("frame_2.csv", "x,y\n1,oops\n");
  const ReadSequence read = ReadAll(directory.path());
  EXPECT_EQ(read.frames.size(), 2u);
  ExpectRefused(read.status, absl::StatusCode::kDataLoss, {"frame_2.csv:2", "'oops'"});
}

}  // namespace
}  // namespace partiemc::client
