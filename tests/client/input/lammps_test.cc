#include <limits>
#include <string>

#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

constexpr char kBox[] = "ITEM: BOX BOUNDS pp pp pp\n0 10\n-5 15\n-0.5 0.5\n";

std::string Frame(const std::string& step, const std::string& count, const std::string& atoms,
                  const std::string& box = kBox) {
  return "ITEM: TIMESTEP\n" + step + "\nITEM: NUMBER OF ATOMS\n" + count + "\n" + box +
         "ITEM: ATOMS " + atoms;
}

ReadSequence ReadDump(const std::string& content, const SequenceOptions& options = {}) {
  const support::TemporaryFolder directory;
  return ReadAll(directory.Write("dump.txt", content), options);
}

TEST(LammpsDump, FramesFollowEachOtherAndMayDifferInCountAndColumns) {
  const ReadSequence read =
      ReadDump(Frame("0", "2", "id type x y\n2 1 3 4\n1 1 1 2\n") +
               Frame("500", "1", "y x id\n6 5 9 \n") + Frame("900", "0", "id x y\n"));
  ASSERT_TRUE(read.status.ok()) << read.status;
  ASSERT_EQ(read.frames.size(), 3u);
  EXPECT_EQ(read.frame_count, 3u);
  EXPECT_THAT(read.frames[0].positions, ElementsAre(3, 4, 1, 2));
  EXPECT_THAT(read.frames[0].ids, ElementsAre(2, 1));
  EXPECT_THAT(read.frames[1].positions, ElementsAre(5, 6));
  EXPECT_EQ(read.frames[2].ParticleCount(), 0u);
  EXPECT_THAT(read.frames[1].source, testing::EndsWith("dump.txt, frame 1 (timestep 500)"));
  EXPECT_FALSE(read.frames[0].time.has_value());
  EXPECT_EQ(read.frames[1].step, 500);
}

TEST(LammpsDump, TheTimeStepTimesItsLengthIsTheTime) {
  const std::string dump =
      Frame("500", "1", "x y\n1 2\n") + "ITEM: TIME\n7\n" + Frame("1500", "1", "x y\n1 2\n");
  const ReadSequence read = ReadDump(dump, {.time_step = 0.002});
  ASSERT_EQ(read.frames.size(), 2u) << read.status;
  EXPECT_EQ(read.frames[0].time, 1);
  EXPECT_EQ(read.frames[1].time, 3) << "the option is the user's word against the file's";
}

TEST(LammpsDump, TheLengthOfATimeStepNeedsStepsAndExcludesTimes) {
  const support::TemporaryFolder directory;
  const std::string table = directory.Write("a.csv", "x,y\n1,2\n");
  ExpectRefused(ReadAll(table, {.time_step = 0.1}).status, absl::StatusCode::kFailedPrecondition,
                {"a.csv", "--time-step", "--times"});
  ExpectRefused(ReadAll(table, {.times = table, .time_step = 0.1}).status,
                absl::StatusCode::kInvalidArgument, {"--time-step", "--times"});
  for (const double wrong : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    ExpectRefused(ReadAll(table, {.time_step = wrong}).status, absl::StatusCode::kInvalidArgument,
                  {"--time-step", "positive"});
  }
}

TEST(LammpsDump, ImageFlagsUnwrapPositions) {
  const ReadSequence read =
      ReadDump(Frame("0", "3", "id x y ix iy iz\n1 1 2 0 0 0\n2 1 2 3 -1 0\n3 1 2 -1 2 0\n"));
  ASSERT_EQ(read.frames.size(), 1u) << read.status;
  EXPECT_THAT(read.frames[0].positions, ElementsAre(1, 2, 31, -18, -9, 42));
  const ReadSequence scaled = ReadDump(Frame("0", "2", "xs ys ix iy\n0.5 0.5 0 0\n0.5 0.5 1 -1\n"));
  ASSERT_EQ(scaled.frames.size(), 1u) << scaled.status;
  EXPECT_THAT(scaled.frames[0].positions, ElementsAre(5, 5, 15, -15));
  const ReadSequence unwrapped = ReadDump(Frame("0", "1", "xu yu ix iy\n1 2 5 5\n"));
  ASSERT_EQ(unwrapped.frames.size(), 1u) << unwrapped.status;
  EXPECT_THAT(unwrapped.frames[0].positions, ElementsAre(1, 2));
}

TEST(LammpsDump, ImageFlagsFollowTheEdgesOfATiltedBox) {
  const std::string tilted = "ITEM: BOX BOUNDS xy xz yz pp pp pp\n0 14 4\n0 20 0\n-0.5 0.5 0\n";
  const ReadSequence read = ReadDump(Frame("0", "1", "x y ix iy\n1 2 1 1\n", tilted));
  ASSERT_EQ(read.frames.size(), 1u) << read.status;
  EXPECT_THAT(read.frames[0].positions, ElementsAre(15, 22));
}

TEST(LammpsDump, NamedColumnsStayWrapped) {
  const ReadSequence read = ReadDump(Frame("0", "1", "x y ix iy\n1 2 1 1\n"), {.columns = "x,y"});
  ASSERT_EQ(read.frames.size(), 1u) << read.status;
  EXPECT_THAT(read.frames[0].positions, ElementsAre(1, 2));
}

TEST(LammpsDump, ImageFlagsNeedABoxAndWholeNumbers) {
  ExpectRefused(ReadDump(Frame("0", "1", "x y ix iy\n1 2 0.5 0\n")).status,
                absl::StatusCode::kDataLoss, {"0.5", "whole number"});
  ExpectRefused(
      ReadDump("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: ATOMS x y ix iy\n1 2 1 0\n")
          .status,
      absl::StatusCode::kDataLoss, {"without BOX BOUNDS"});
}

TEST(LammpsDump, BoxHasBoundsAndBoundaries) {
  const std::string mixed = "ITEM: BOX BOUNDS pp ff ps\n0 10\n-5 15\n-0.5 0.5\n";
  const ReadSequence read =
      ReadDump(Frame("0", "1", "x y\n1 2\n", mixed) + Frame("1", "1", "x y\n1 2\n") +
               Frame("2", "1", "x y\n1 2\n", "ITEM: BOX BOUNDS\n0 10\n-5 15\n-0.5 0.5\n"));
  ASSERT_EQ(read.frames.size(), 3u) << read.status;
  ASSERT_TRUE(read.frames[0].box.has_value());
  EXPECT_THAT(read.frames[0].box->low, ElementsAre(0, -5, 0));
  EXPECT_THAT(read.frames[0].box->length, ElementsAre(10, 20, 0));
  EXPECT_THAT(read.frames[0].box->is_periodic, ElementsAre(true, false, false));
  EXPECT_THAT(read.frames[1].box->is_periodic, ElementsAre(true, true, false));
  EXPECT_THAT(read.frames[2].box->is_periodic, ElementsAre(false, false, false));
  EXPECT_FALSE(read.frames[0].box->is_tilted);
}

// The particles lie in the plane y = 2, so z becomes the second axis.
TEST(LammpsDump, BoxHasTheAxesOfThePositions) {
  const ReadSequence read = ReadDump(Frame("0", "2", "x y z\n1 2 0.1\n3 2 0.2\n"));
  ASSERT_EQ(read.frames.size(), 1u) << read.status;
  EXPECT_THAT(read.frames[0].box->low, ElementsAre(0, -.5, 0));
  EXPECT_THAT(read.frames[0].box->length, ElementsAre(10, 1, 0));
}

TEST(LammpsDump, BoxesMayChangeAndBeTriclinic) {
  const std::string atoms = "x y\n1 2\n";
  const std::string wider = "ITEM: BOX BOUNDS pp pp pp\n0 10.5\n-5 15\n-0.5 0.5\n";
  const std::string tilted = "ITEM: BOX BOUNDS xy xz yz pp pp pp\n0 14 4\n0 20 0\n-0.5 0.5 0\n";
  const ReadSequence read = ReadDump(Frame("0", "1", atoms) + Frame("1", "1", atoms, wider) +
                                     Frame("2", "1", atoms, tilted) + Frame("3", "1", atoms, ""));
  ASSERT_EQ(read.frames.size(), 4u) << read.status;
  EXPECT_EQ(read.frames[0].box->length[0], 10);
  EXPECT_EQ(read.frames[1].box->length[0], 10.5);
  EXPECT_TRUE(read.frames[2].box->is_tilted);
  EXPECT_FALSE(read.frames[3].box.has_value());
}

TEST(LammpsDump, ASelectionThatHoldsForNoParticleIsRefused) {
  const std::string dump =
      Frame("0", "1", "type x y\n1 1 2\n") + Frame("1", "2", "type x y\n1 1 2\n2 3 4\n");
  const ReadSequence late = ReadDump(dump, {.select = {"type=2"}});
  ASSERT_TRUE(late.status.ok()) << "particles may come later: " << late.status;
  EXPECT_EQ(late.frames[0].ParticleCount(), 0u);
  EXPECT_EQ(late.frames[1].ParticleCount(), 1u);
  ExpectRefused(ReadDump(dump, {.select = {"type=3"}}).status,
                absl::StatusCode::kFailedPrecondition,
                {"dump.txt", "none of 3 particles", "--select type=3"});
  const ReadSequence empty = ReadDump(Frame("0", "0", "type x y\n"), {.select = {"type=3"}});
  EXPECT_TRUE(empty.status.ok()) << "no particle, nothing to select: " << empty.status;
}

TEST(Csv, ASelectionThatHoldsForNoRowIsRefused) {
  const support::TemporaryFolder directory;
  ExpectRefused(
      ReadAll(directory.Write("a.csv", "x,y,kind\n1,2,wall\n"), {.select = {"kind=fluid"}}).status,
      absl::StatusCode::kFailedPrecondition, {"none of 1 particles", "--select kind=fluid"});
}

TEST(LammpsDump, UnitsAndTimeMayComeBeforeTheTimeStep) {
  const ReadSequence read =
      ReadDump("ITEM: UNITS\nlj\nITEM: TIME\n0.25\n" + Frame("5", "1", "x y\n1 2\n") +
               "ITEM: TIME\n0.5\n" + Frame("10", "1", "x y\n1 2\n"));
  ASSERT_EQ(read.frames.size(), 2u) << read.status;
  EXPECT_EQ(read.frames[0].time, 0.25);
  EXPECT_EQ(read.frames[1].time, 0.5);
}

TEST(LammpsDump, ScaledPositionsAreFractionsOfTheBox) {
  const ReadSequence read = ReadDump(Frame("0", "2", "id xs ys zs\n1 0 0 0.5\n2 0.25 0.5 0.5\n"));
  ASSERT_EQ(read.frames.size(), 1u) << read.status;
  EXPECT_THAT(read.frames[0].positions, ElementsAre(0, -5, 2.5, 5));
}

TEST(LammpsDump, ATiltedBoxShearsScaledPositions) {
  // A box of 10 x 20 with a tilt of 4: its bounding box is 14 wide.
  const std::string tilted = "ITEM: BOX BOUNDS xy xz yz pp pp pp\n0 14 4\n0 20 0\n-0.5 0.5 0\n";
  const ReadSequence read = ReadDump(Frame("0", "2", "xs ys\n0 1\n0.5 0.5\n", tilted));
  ASSERT_EQ(read.frames.size(), 1u) << read.status;
  EXPECT_THAT(read.frames[0].positions, ElementsAre(4, 20, 7, 10));
}

TEST(LammpsDump, TheBoundsOfATriclinicBoxHoldAllOfItsCorners) {
  // Boxes of 10 x 20 x 1 with two tilts along x: the corner of both tilts is the farthest.
  const std::string head = "ITEM: BOX BOUNDS xy xz yz pp pp pp\n";
  for (const std::string bounds :
       {"0 17 4\n-2 20 3\n-0.5 0.5 -2\n", "-7 10 -4\n0 22 -3\n-0.5 0.5 2\n"}) {
    const ReadSequence read = ReadDump(Frame("0", "2", "xs ys\n0 0\n1 0\n", head + bounds));
    ASSERT_EQ(read.frames.size(), 1u) << read.status;
    EXPECT_THAT(read.frames[0].positions, ElementsAre(0, 0, 10, 0)) << bounds;
  }
}

TEST(LammpsDump, ABoxGivenByItsEdgesIsTheSameBox) {
  const std::string edges =
      "ITEM: BOX BOUNDS abc origin pp pp pp\n10 0 0 0\n4 20 0 0\n0 0 1 -0.5\n";
  const ReadSequence read = ReadDump(Frame("0", "2", "xs ys\n0 1\n0.5 0.5\n", edges));
  ASSERT_EQ(read.frames.size(), 1u) << read.status;
  EXPECT_THAT(read.frames[0].positions, ElementsAre(4, 20, 7, 10));
}

TEST(LammpsDump, SelectionTakesTheFluidAndLeavesTheWall) {
  const ReadSequence read =
      ReadDump(Frame("0", "3", "id type x y\n1 1 1 2\n2 2 3 4\n3 1 5 6\n"), {.select = {"type=1"}});
  ASSERT_EQ(read.frames.size(), 1u) << read.status;
  EXPECT_THAT(read.frames[0].positions, ElementsAre(1, 2, 5, 6));
  EXPECT_THAT(read.frames[0].ids, ElementsAre(1, 3));
}

TEST(LammpsDump, AFrameThatIsCutOffIsNamedAndThoseBeforeAreDelivered) {
  const std::string whole =
      Frame("0", "2", "x y\n1 2\n3 4\n") + Frame("500", "2", "x y\n5 6\n7 8\n");
  const std::size_t first = Frame("0", "2", "x y\n1 2\n3 4\n").size();
  for (std::size_t size = first + 1; size + 3 < whole.size(); ++size) {
    const ReadSequence read = ReadDump(whole.substr(0, size));
    EXPECT_EQ(read.frames.size(), 1u) << size;
    ExpectRefused(read.status, absl::StatusCode::kDataLoss, {"dump.txt:", "frame 1"});
  }
  ExpectRefused(ReadDump(whole.substr(0, whole.size() - 4)).status, absl::StatusCode::kDataLoss,
                {"(timestep 500)", "after 1 of 2 atoms", "truncated"});
}

TEST(LammpsDump, DeclaredCountsAreNotBelieved) {
  for (const char* count : {"18446744073709551615", "99999999999999999999999", "-1", "many"}) {
    ExpectRefused(ReadDump(Frame("0", count, "x y\n1 2\n")).status, absl::StatusCode::kDataLoss,
                  {"number of atoms", count});
  }
  // An allowed but false count: takes no memory for missing data.
  ExpectRefused(ReadDump(Frame("0", "60000000", "x y\n1 2\n")).status, absl::StatusCode::kDataLoss,
                {"after 1 of 60000000 atoms"});
}

TEST(LammpsDump, DamageIsRefusedInOneLine) {
  ExpectRefused(ReadDump(Frame("0", "1", "x y\n1 2\n3 4\n")).status, absl::StatusCode::kDataLoss,
                {"expected a line that begins with ITEM:"});
  ExpectRefused(ReadDump("ITEM: ATOMS x y\n1 2\n").status, absl::StatusCode::kDataLoss,
                {"before the number of atoms"});
  ExpectRefused(
      ReadDump("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: ATOMS xs ys\n0 0\n").status,
      absl::StatusCode::kDataLoss, {"without BOX BOUNDS"});
  ExpectRefused(ReadDump("ITEM: TIMESTEP\n0\nITEM: BOX BOUNDS pp\n0\n0 1\n0 1\n").status,
                absl::StatusCode::kDataLoss, {"BOX BOUNDS"});
  ExpectRefused(ReadDump("ITEM: NUMBER OF ENTRIES\n0\n").status, absl::StatusCode::kDataLoss,
                {"unknown ITEM"});
  ExpectRefused(ReadDump(Frame("0", "1", "id mass\n1 2\n")).status,
                absl::StatusCode::kFailedPrecondition, {"no position columns", "id,mass"});
}

TEST(LammpsDump, TheSamplesAgreeWithEachOther) {
  const ReadSequence scaled = ReadAll(SamplePath("dump.atom"));
  const ReadSequence timed = ReadAll(SamplePath("dump.custom.units_time.gz"));
  const ReadSequence unwrapped = ReadAll(SamplePath("dump.custom.unwrapped_scaled"));
  ASSERT_EQ(scaled.frames.size(), 4u) << scaled.status;
  ASSERT_EQ(timed.frames.size(), 4u) << timed.status;
  ASSERT_EQ(unwrapped.frames.size(), 4u) << unwrapped.status;
  EXPECT_THAT(scaled.frames[0].positions, Pointwise(DoubleNear(1e-4), timed.frames[0].positions));
  EXPECT_THAT(unwrapped.frames[0].positions,
              Pointwise(DoubleNear(1e-4), timed.frames[0].positions));
  EXPECT_EQ(timed.frames[3].time, 1.5);
}

}  // namespace
}  // namespace partiemc::client
