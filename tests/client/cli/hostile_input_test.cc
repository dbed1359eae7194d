// Malformed inputs, and outputs that cannot be written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// Three frames of 900 particles with times, which a notice reports.
void WriteFramesWithTimes(const support::TemporaryFolder& directory) {
  for (int k = 0; k < 3; ++k) {
    std::ofstream file(directory.Path("frame_" + std::to_string(k) + ".csv"));
    file << "x,y\n";
    for (int row = 0; row < 30; ++row) {
      for (int column = 0; column < 30; ++column) file << column << "," << row + 0.01 * k << "\n";
    }
  }
  std::ofstream(directory.Path("times.csv")) << "frame,t\n0,0\n1,1\n2,2\n";
}

TEST(FullDisk, EndsWithTheErrorInTheLastLine) {
  const support::TemporaryFolder input, output;
  WriteFramesWithTimes(input);
  const std::string frames = input.path().string();
  const std::vector<std::vector<std::string>> commands = {
      {"replay", frames, "--local", "--output-dir", output.Path("frames")},
      {"replay", frames, "--local", "--report", output.Path("report.html")},
      {"convert", frames, output.Path("frames.pemc")}};
  for (const auto& command : commands) {
    const Ran ran = RunPartiemcOnFullDisk(1, command);
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.error, HasSubstr("times of the frames from"));
    EXPECT_THAT(LastLine(ran.error),
                AllOf(StartsWith("partiemc: " + output.path().string()), HasSubstr("too large")));
    EXPECT_THAT(FilesIn(output.path()), Each(Not(HasSubstr(".part"))));
  }
}

TEST(FullDisk, IsAnErrorForStandardOutputToo) {
  for (const auto& command :
       std::vector<std::vector<std::string>>{{"--version"},
                                             {"replay", "--help"},
                                             {"replay", kDamBreak, "--local", "--frames", "0"}}) {
    std::vector<std::string> arguments = {"-c", "exec \"$0\" \"$@\" > /dev/full", PARTIEMC_PROGRAM};
    arguments.insert(arguments.end(), command.begin(), command.end());
    Program program("/bin/sh", arguments);
    EXPECT_EQ(program.Wait(), 1);
    EXPECT_THAT(LastLine(program.Error()), StartsWith("partiemc: standard output: cannot be"));
  }
}

TEST(Input, IsNotOverwritten) {
  const support::TemporaryFolder directory;
  const std::string csv = directory.Path("in/frame_000000.csv");
  const std::string pemc = directory.Path("a.pemc"), link = directory.Path("link.pemc");
  std::filesystem::create_directory(directory.Path("in"));
  std::ofstream(csv) << "x,y\n0,0\n1,0\n2,0\n0,1\n1,1\n2,1\n0,2\n1,2\n2,2\n";
  std::ofstream(directory.Path("in/times.csv")) << "frame,t\n0,0.5\n";
  ASSERT_EQ(RunPartiemc({"convert", csv, pemc}).exit_code, 0);
  std::filesystem::create_symlink(pemc, link);
  const std::string recorded = Content(pemc), table = Content(csv);
  const std::string in = directory.Path("in");
  const std::vector<std::vector<std::string>> commands = {
      {"convert", pemc, pemc, "--frames", "0:1"},
      {"convert", pemc, link},
      {"replay", csv, "--local", "--stats", directory.Path("in/../in/frame_000000.csv")},
      {"replay", in, "--local", "--stats", directory.Path("in/times.csv")},
      {"replay", in, "--local", "--report", csv},
      {"replay", in, "--local", "--output-dir", in, "--format", "svg,csv"}};
  for (const auto& command : commands) {
    const Ran ran = RunPartiemc(command);
    EXPECT_EQ(ran.exit_code, 2) << ::testing::PrintToString(command);
    EXPECT_THAT(LastLine(ran.error), HasSubstr("would overwrite the input"));
  }
  EXPECT_EQ(Content(pemc), recorded);
  EXPECT_EQ(Content(csv), table);
  EXPECT_THAT(FilesIn(in), ElementsAre("frame_000000.csv", "times.csv"));
  EXPECT_EQ(RunPartiemc({"replay", in, "--local", "--output-dir", in, "--format", "svg"}).exit_code,
            0);
  EXPECT_THAT(FilesIn(in), ElementsAre("frame_000000.csv", "frame_000000.svg", "times.csv"));
}

// zstd compresses equal lines ten-thousandfold.
TEST(PackedInput, IsRefusedWhenItExpandsTooMuch) {
  const support::TemporaryFolder directory;
  std::string table = "x,y\n";
  while (table.size() < std::size_t{100} << 20) table += "#" + std::string(4094, '-') + "\n";
  table += "1,2\n3,4\n";
  std::string packed(ZSTD_compressBound(table.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), table.data(), table.size(), 1));
  const std::string path = directory.Path("bomb.csv.zst");
  std::ofstream(path, std::ios::binary) << packed;
  const std::vector<std::string> convert = {"convert", path, directory.Path("out.pemc")};
  const Ran refused = RunPartiemc(convert);
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(LastLine(refused.error), AllOf(HasSubstr(path), HasSubstr("--max-expansion")));
  EXPECT_THAT(RunPartiemc({"convert", "--help"}).out, HasSubstr("--max-expansion RATIO"));
  std::vector<std::string> trusting = convert;
  trusting.insert(trusting.end(), {"--max-expansion", "1e6"});
  EXPECT_EQ(RunPartiemc(trusting).exit_code, 0);
}

}  // namespace
}  // namespace partiemc::client
