// `partiemc convert` as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/program.h"
#include "client/recording/recording.h"

namespace partiemc::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A LAMMPS dump of three frames: two grains and one wall particle, far from the origin.
void WriteGrainDump(const std::string& path, double origin) {
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
  WriteGrainDump(directory.Path("dump.lammpstrj"), 0);
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

// A ball with a radius of five spacings.
void WriteBall(const std::string& path) {
  std::ofstream file(path);
  file << "x,y,z,vx,vy,vz\n";
  for (int x = -5; x <= 5; ++x) {
    for (int y = -5; y <= 5; ++y) {
      for (int z = -5; z <= 5; ++z) {
        if (x * x + y * y + z * z < 25) file << x << "," << y << "," << z << ",1,2,3\n";
      }
    }
  }
}

TEST(Convert, KeepsParticlesInSpaceForSlices) {
  const support::TemporaryFolder directory;
  std::filesystem::create_directory(directory.Path("ball"));
  WriteBall(directory.Path("ball/frame_0.csv"));
  WriteBall(directory.Path("ball/frame_1.csv"));
  std::ofstream(directory.Path("ball/times.csv")) << "0\n0.5\n";
  const std::string recording = directory.Path("ball.pemc");
  ASSERT_EQ(RunPartiemc({"convert", directory.Path("ball"), recording, "--in-space", "--float64",
                         "--spacing", "1"})
                .exit_code,
            0);
  const auto stats = [&](const std::string& input, const std::string& file) {
    std::vector<std::string> flags = {"replay",  input,     "--local", "--slice",
                                      "z=.5",    "--slice", "x=1",     "--isolines",
                                      "0.4,0.6", "--check", "--stats", directory.Path(file)};
    if (input != recording) flags.insert(flags.end(), {"--spacing", "1"});
    const Ran ran = RunPartiemc(flags);
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    return Content(directory.Path(file));
  };
  // Ignores the columns of milliseconds.
  const auto digests = [](const std::string& csv) {
    std::vector<std::string> rows;
    std::istringstream lines(csv);
    for (std::string line; std::getline(lines, line);) {
      std::size_t cut = line.size();
      for (int commas = 0; commas < 5 && cut != std::string::npos; ++commas) {
        cut = line.rfind(',', cut - 1);
      }
      rows.push_back(line.substr(cut));
    }
    return rows;
  };
  const auto of_recording = digests(stats(recording, "recording.csv"));
  EXPECT_EQ(of_recording.size(), 1u + 2 * 6) << "two slices, each with two isolines";
  EXPECT_EQ(of_recording, digests(stats(directory.Path("ball"), "files.csv")));

  const Ran flat = RunPartiemc({"replay", recording, "--local"});
  EXPECT_EQ(flat.exit_code, 3);
  EXPECT_THAT(flat.error, HasSubstr("has three coordinates; replay it with --slice or --surface"));
  const Ran sliced = RunPartiemc({"replay", kDamBreak, "--local", "--slice", "z=0"});
  EXPECT_EQ(sliced.exit_code, 3);
  EXPECT_THAT(sliced.error, HasSubstr("has two coordinates; leave --slice"));
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

TEST(Convert, ATruncatedRecordingIsReportedEvenIfQuiet) {
  const support::TemporaryFolder directory;
  const std::string whole = directory.Path("whole.pemc"), copy = directory.Path("copy.pemc");
  ASSERT_EQ(RunPartiemc({"convert", kDamBreak, whole, "--frames", "0:10"}).exit_code, 0);
  std::filesystem::resize_file(whole, std::filesystem::file_size(whole) - 100);
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"convert", whole, copy, "--quiet"}, {"replay", whole, "--local", "--quiet"}}) {
    const Ran ran = RunPartiemc(command);
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.error, "partiemc: " + whole +
                             ": truncated after 8 frames; what was recorded later is lost\n");
    EXPECT_THAT(ran.out, IsEmpty());
  }
}

TEST(Convert, RefusesFloat32FarFromTheOriginAndLeavesNothingBehind) {
  const support::TemporaryFolder directory;
  WriteGrainDump(directory.Path("far.lammpstrj"), 1e6);
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
