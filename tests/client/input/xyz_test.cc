#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

using testing::ElementsAre;

TEST(Xyz, FramesOfALammpsXyzDumpAreRead) {
  const support::TemporaryFolder directory;
  const ReadSequence read = ReadAll(directory.Write(
      "dump.xyz",
      "2\nAtoms. Timestep: 0\n1 1 2 0\n2 3 4 0\n0\nAtoms. Timestep: 5\n1\nx\nSi 5 6 0\n"));
  ASSERT_TRUE(read.status.ok()) << read.status;
  ASSERT_EQ(read.frames.size(), 3u);
  EXPECT_THAT(read.frames[0].positions, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(read.frames[1].ParticleCount(), 0u);
  EXPECT_THAT(read.frames[2].positions, ElementsAre(5, 6));
}

TEST(Xyz, ElementsCanBeSelected) {
  EXPECT_EQ(
      ReadAll(SamplePath("dump.elem.xyz"), {.select = {"type=Si"}}).frames.at(0).ParticleCount(),
      48u);
  ExpectRefused(ReadAll(SamplePath("dump.elem.xyz"), {.select = {"type=O"}}).status,
                absl::StatusCode::kFailedPrecondition, {"--select type=O"});
}

TEST(Xyz, AFrameThatIsCutOffIsNamedAndThoseBeforeAreDelivered) {
  const support::TemporaryFolder directory;
  const ReadSequence read =
      ReadAll(directory.Write("dump.xyz", "1\nAtoms. Timestep: 0\n1 1 2 0\n3\nAtoms.\n1 1 2 0\n"));
  EXPECT_EQ(read.frames.size(), 1u);
  ExpectRefused(read.status, absl::StatusCode::kDataLoss, {"frame 1", "after 1 of 3 particles"});
}

TEST(Xyz, RowsWithoutATypeAreRefusedWithTheRemedy) {
  const support::TemporaryFolder directory;
  ExpectRefused(ReadAll(directory.Write("a.xyz", "2\ncomment\n1 2 0\n3 4 0\n")).status,
                absl::StatusCode::kDataLoss, {"a.xyz:3", "must have type, x, y and z", "table"});
}

TEST(Xyz, DeclaredCountsAreNotBelieved) {
  const support::TemporaryFolder directory;
  ExpectRefused(ReadAll(directory.Write("a.xyz", "18446744073709551615\nAtoms.\n1 1 2 0\n")).status,
                absl::StatusCode::kDataLoss, {"a.xyz:1", "number of particles"});
}

TEST(Xyz, ExtendedXyzDescribesItsColumnsAndItsTime) {
  const support::TemporaryFolder directory;
  const ReadSequence read =
      ReadAll(directory.Write(
                  "a.xyz",
                  "1\nLattice=\"9 0 0 0 9 0 0 0 1\" "
                  "Properties=id:I:1:species:S:1:pos:R:3:velo:R:3:p:R:1 Time=0.25 pbc=\"F F F\"\n"
                  "7 Si 1 2 0 3 4 0 5\n"
                  "2\nTime=0.5 Properties=pos:R:3:species:S:1\n1 2 0 O\n3 4 0 Si\n"),
              {.select = {"species=Si"}});
  ASSERT_TRUE(read.status.ok()) << read.status;
  ASSERT_EQ(read.frames.size(), 2u);
  EXPECT_THAT(read.frames[0].positions, ElementsAre(1, 2));
  EXPECT_THAT(read.frames[0].ids, ElementsAre(7));
  EXPECT_THAT(read.frames[0].velocities, ElementsAre(3, 4));
  EXPECT_EQ(read.frames[0].time, 0.25);
  EXPECT_THAT(read.frames[1].positions, ElementsAre(3, 4));
  EXPECT_EQ(read.frames[1].time, 0.5);
}

TEST(Xyz, LatticesAreBoxes) {
  const support::TemporaryFolder directory;
  const auto box = [&](const std::string& comment) {
    return ReadOne(directory.Write("a.xyz", "1\n" + comment + "\nA 1 2 0\n")).box;
  };
  const std::string lattice = "Lattice=\"9 0 0 0 8 0 0 0 1\"";
  const RecordedBox whole{.low = {0, 0}, .length = {9, 8}, .is_periodic = {true, true}};
  EXPECT_EQ(box(lattice), whole);
  EXPECT_EQ(box("pbc=\"T T F\" " + lattice), whole);
  EXPECT_EQ(box("Lattice=\"9 1e-15 0 -1e-15 8 0 0 0 1\""), whole) << "rounding errors";
  RecordedBox other = whole;
  other.low = {-4, 3};
  other.is_periodic[0] = false;
  EXPECT_EQ(box(lattice + " Origin=\"-4 3 0\" pbc=\"F T F\""), other);
  EXPECT_TRUE(box("Lattice=\"9 0 0 1 8 0 0 0 1\"").value().is_tilted);
  EXPECT_TRUE(box("Lattice=\"0 9 0 8 0 0 0 0 1\"").value().is_tilted);
  for (const std::string wrong : {"", "Lattice=\"9 0 0 0 8 0\"", "Lattice=9",
                                  "Lattice=\"9 0 0 0 8 0 0 0 nan\"", "Lattice=\"a b c\""}) {
    EXPECT_EQ(box(wrong), std::nullopt) << wrong;
  }
}

TEST(Xyz, TheTimestepOfLammpsIsTheStep) {
  const support::TemporaryFolder directory;
  const RecordedFrame frame =
      ReadOne(directory.Write("a.xyz", "1\nAtoms. Timestep: 500\n1 1 2 0\n"), {.time_step = 0.5});
  EXPECT_EQ(frame.step, 500);
  EXPECT_EQ(frame.time, 250);
}

TEST(Xyz, BrokenDescriptionsOfColumnsAreRefused) {
  const support::TemporaryFolder directory;
  for (const std::string properties : {"pos:R", "pos:R:many", "pos:R:5000", "id:I:1:pos:R:0:"}) {
    ExpectRefused(
        ReadAll(directory.Write("a.xyz", "1\nProperties=" + properties + "\n1 2 0\n")).status,
        absl::StatusCode::kDataLoss, {"a.xyz:2", "NAME:TYPE:COLUMNS"});
  }
  ExpectRefused(ReadAll(directory.Write("a.xyz", "1\nProperties=pos:R:3\n1 2\n")).status,
                absl::StatusCode::kDataLoss, {"a.xyz:3", "2 of 3 values"});
}

TEST(Xyz, PointsWithoutACountAreATable) {
  const support::TemporaryFolder directory;
  EXPECT_THAT(ReadOne(directory.Write("cloud.xyz", "1 2 0\n3 4 0\n")).positions,
              ElementsAre(1, 2, 3, 4));
}

TEST(Xyz, RefusesTimesThatAreNotFinite) {
  const support::TemporaryFolder directory;
  for (const char* time : {"nan", "inf", "-inf"}) {
    const std::string path =
        directory.Write("a.xyz", std::string("1\nTime=") + time + "\n1 0 0 0\n");
    ExpectRefused(ReadAll(path).status, absl::StatusCode::kDataLoss,
                  {"a.xyz", "frame 0", "not finite", "--times"});
    const std::string times = directory.Write("t.csv", "frame,t\n0,2\n");
    EXPECT_EQ(ReadOne(path, {.times = times}).time, 2);
  }
}

}  // namespace
}  // namespace partiemc::client
