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
  EXPECT_EQ(
      ReadAll(SamplePath("dump.elem.xyz"), {.select = {"type=O"}}).frames.at(0).ParticleCount(),
      0u);
}

TEST(Xyz, AFrameThatIsCutOffIsNamedAndThoseBeforeAreDelivered) {
  const support::TemporaryFolder directory;
  const ReadSequence read =
      ReadAll(directory.Write("dump.xyz", "1\nAtoms. Timestep: 0\n1 1 2 0\n3\nAtoms.\n1 1 2 0\n"));
  EXPECT_EQ(read.frames.size(), 1u);
  ExpectRefused(read.status, absl::StatusCode::kDataLoss, {"frame 1", "after 1 of 3 particles"});
}

TEST(Xyz, DeclaredCountsAreNotBelieved) {
  const support::TemporaryFolder directory;
  ExpectRefused(ReadAll(directory.Write("a.xyz", "18446744073709551615\nAtoms.\n1 1 2 0\n")).status,
                absl::StatusCode::kDataLoss, {"a.xyz:1", "number of particles"});
}

TEST(Xyz, OtherColumnsThanSpeciesAndPositionAreRefused) {
  const support::TemporaryFolder directory;
  ExpectRefused(
      ReadAll(directory.Write("a.xyz", "1\nProperties=id:I:1:pos:R:3 pbc=\"F F F\"\n1 1 2 0\n"))
          .status,
      absl::StatusCode::kUnimplemented, {"extended XYZ", "CSV"});
}

TEST(Xyz, PointsWithoutACountAreATable) {
  const support::TemporaryFolder directory;
  EXPECT_THAT(ReadOne(directory.Write("cloud.xyz", "1 2 0\n3 4 0\n")).positions,
              ElementsAre(1, 2, 3, 4));
}

}  // namespace
}  // namespace partiemc::client
