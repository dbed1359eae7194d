// `partiemc convert`, as a person runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "client/cli/program.h"
#include "client/recording/recording.h"

namespace partiemc::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A LAMMPS dump of three frames: two grains and one wall particle, far from the origin.
void WriteDump(const std::string& path, double origin) {
  std::ofstream file(path);
  for (int k = 0; k < 3; ++k) {
    file << "ITEM: TIMESTEP\n"
         << 100 * k << "\nITEM: NUMBER OF ATOMS\n3\nITEM: BOX BOUNDS pp pp pp\n"
         << "-10 1e7\n-10 10\n-0.1 0.1\nITEM: ATOMS id type x y\n";
    file.precision(12);
    for (int p = 0; p < 3; ++p) {
      file << p + 1 << " " << (p == 2 ? 2 : 1) << " " << origin + 0.123456789 * p << " " << k
           << "\n";
    }
  }
}

TEST(Convert, KeepsTheFramesAndTheParticlesThatWereAskedFor) {
  const support::TemporaryFolder directory;
  WriteDump(directory.Path("dump.lammpstrj"), 0);
  const Ran ran = RunPartiemc({"convert", directory.Path("dump.lammpstrj"),
                               directory.Path("out.pemc"), "--select", "type=1", "--frames", "1:3",
                               "--spacing", "0.5", "--title", "two grains"});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.out, HasSubstr("out.pemc: 2 frames"));
  const auto reader = RecordingReader::Open(directory.Path("out.pemc"), "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ((*reader)->header().spacing, 0.5);
  EXPECT_EQ((*reader)->header().title, "two grains");
  RecordedFrame frame;
  ASSERT_TRUE(*(*reader)->Next(frame));
  EXPECT_THAT(frame.positions, ElementsAre(0, 1, 0.123456789f, 1));
  EXPECT_THAT(frame.ids, ElementsAre(1, 2));
}

TEST(Convert, ARecordingOfARecordingIsTheSame) {
  const support::TemporaryFolder directory;
  ASSERT_EQ(RunPartiemc({"convert", kDamBreak, directory.Path("a.pemc")}).exit_code, 0);
  const auto original = RecordingReader::Open(kDamBreak, "");
  const auto copy = RecordingReader::Open(directory.Path("a.pemc"), "");
  ASSERT_TRUE(original.ok() && copy.ok());
  EXPECT_EQ((*copy)->header().spacing, (*original)->header().spacing);
  RecordedFrame a, b;
  int frames = 0;
  while (*(*original)->Next(a)) {
    ASSERT_TRUE(*(*copy)->Next(b));
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.velocities, b.velocities);
    EXPECT_EQ(a.time, b.time);
    ++frames;
  }
  EXPECT_EQ(frames, 75);
}

TEST(Convert, RefusesFloat32FarFromTheOriginAndLeavesNothingBehind) {
  const support::TemporaryFolder directory;
  WriteDump(directory.Path("far.lammpstrj"), 1e6);
  const std::vector<std::string> arguments = {"convert", directory.Path("far.lammpstrj"),
                                              directory.Path("far.pemc"), "--spacing", "0.1"};
  const Ran refused = RunPartiemc(arguments);
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.error, HasSubstr("--float64"));
  EXPECT_THAT(FilesIn(directory.path()), ElementsAre("far.lammpstrj"));
  auto with_float64 = arguments;
  with_float64.push_back("--float64");
  EXPECT_EQ(RunPartiemc(with_float64).exit_code, 0);
}

TEST(Convert, AnInputThatIsNotThereIsExitCodeThree) {
  const support::TemporaryFolder directory;
  const Ran ran = RunPartiemc({"convert", "/nonexistent", directory.Path("out.pemc")});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(FilesIn(directory.path()), IsEmpty());
}

}  // namespace
}  // namespace partiemc::client
