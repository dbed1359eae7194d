// `partiemc replay --phases` as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;

// A square of 20 x 20 particles of type 1, with a strip of type 2.
void WritePhases(const std::string& path) {
  std::ofstream file(path);
  file << "x,y,type\n";
  for (int j = 0; j < 20; ++j) {
    for (int i = 0; i < 20; ++i) file << i << "," << j << "," << (i + j / 4 < 12 ? 1 : 2) << "\n";
  }
}

TEST(PhasesReplay, EachPhaseIsASectionWithItsArea) {
  const support::TemporaryFolder folder;
  WritePhases(folder.Path("frame.csv"));
  std::vector<std::vector<std::string>> digests;
  ServerProgram server;
  for (const std::vector<std::string>& where :
       {std::vector<std::string>{"--local"}, {"--server", server.address()}}) {
    std::vector<std::string> arguments = {
        "replay",  folder.Path("frame.csv"), "--spacing", "1", "--phases", "type=1,2", "--check",
        "--stats", folder.Path("s.csv")};
    arguments.insert(arguments.end(), where.begin(), where.end());
    const Ran ran = RunPartiemc(arguments);
    ASSERT_EQ(ran.exit_code, 0) << ran.error;
    const std::string stats = Content(folder.Path("s.csv"));
    digests.push_back(Column(stats, "rings_digest"));
    const auto areas = Column(stats, "area");
    ASSERT_EQ(areas.size(), 3u);
    EXPECT_NEAR(std::stod(areas[1]) + std::stod(areas[2]), std::stod(areas[0]), 1e-6);
    EXPECT_NEAR(std::stod(areas[1]), 200, 1);
  }
  EXPECT_EQ(digests[0], digests[1]);
}

// Two fluids of the types 1 and 2 on a floor of particles of the type 3, beside a wall.
TEST(PhasesReplay, PhasesEndAtWalls) {
  const support::TemporaryFolder folder;
  const std::string csv = folder.Path("frame.csv"), stats = folder.Path("s.csv");
  std::ofstream file(csv);
  file << "x,y,type\n";
  for (int i = 0; i < 24; ++i) {
    for (int j = -2; j < 16; ++j) {
      file << i + .5 << "," << j + .5 << "," << (j < 0 ? 3 : j < 6 ? 1 : 2) << "\n";
    }
  }
  file.close();
  std::vector<std::vector<std::string>> digests;
  ServerProgram server;
  for (const std::vector<std::string>& where :
       {std::vector<std::string>{"--local"}, {"--server", server.address()}}) {
    std::vector<std::string> arguments = {"replay",   csv,      "--spacing", "1",      "--phases",
                                          "type=1,2", "--wall", "type=3",    "--wall", "0,1,0,0",
                                          "--stats",  stats,    "--check"};
    arguments.insert(arguments.end(), where.begin(), where.end());
    const Ran ran = RunPartiemc(arguments);
    ASSERT_EQ(ran.exit_code, 0) << ran.error;
    const auto areas = Column(Content(stats), "area");
    ASSERT_EQ(areas.size(), 3u);
    EXPECT_NEAR(std::stod(areas[1]), 24 * 6, 1);
    EXPECT_NEAR(std::stod(areas[2]), 24 * 10, 1);
    digests.push_back(Column(Content(stats), "rings_digest"));
  }
  EXPECT_EQ(digests[0], digests[1]);
  const Ran other = RunPartiemc(
      {"replay", csv, "--spacing", "1", "--phases", "type=1,2", "--wall", "kind=3", "--local"});
  EXPECT_NE(other.exit_code, 0);
  EXPECT_THAT(other.error, HasSubstr("the attribute of --phases"));
}

// A box of 30 x 24 with a drop of type 2 across its corner.
TEST(PhasesReplay, PhasesAreCutAtThePeriodicBox) {
  const support::TemporaryFolder folder;
  const std::string csv = folder.Path("frame.csv"), stats = folder.Path("s.csv");
  std::ofstream file(csv);
  file << "x,y,type\n";
  int count = 0;
  for (int j = 0; j < 24; ++j) {
    for (int i = 0; i < 30; ++i) {
      const bool is_drop = std::hypot(i < 15 ? i : i - 30, j < 12 ? j : j - 24) < 6;
      count += is_drop ? 1 : 0;
      file << i + .5 << "," << j + .5 << "," << (is_drop ? 2 : 1) << "\n";
    }
  }
  file.close();
  ServerProgram server;
  for (const bool wraps : {false, true}) {
    std::vector<std::vector<std::string>> digests;
    for (const std::vector<std::string>& where :
         {std::vector<std::string>{"--local"}, {"--server", server.address()}}) {
      std::vector<std::string> arguments = {
          "replay", csv,     "--spacing", "1",       "--phases", "type=1,2", "--periodic",
          "x,y",    "--box", "0,30,0,24", "--check", "--stats",  stats};
      if (wraps) arguments.push_back("--wrap");
      arguments.insert(arguments.end(), where.begin(), where.end());
      const Ran ran = RunPartiemc(arguments);
      ASSERT_EQ(ran.exit_code, 0) << ran.error;
      digests.push_back(Column(Content(stats), "rings_digest"));
      const auto areas = Column(Content(stats), "area");
      ASSERT_EQ(areas.size(), 3u);
      EXPECT_NEAR(std::stod(areas[0]), 720, 1e-6);
      EXPECT_NEAR(std::stod(areas[1]) + std::stod(areas[2]), 720, 1e-6);
      EXPECT_NEAR(std::stod(areas[2]), count, .01 * count);
      EXPECT_EQ(Column(Content(stats), "polylines")[2], "4");
    }
    EXPECT_EQ(digests[0], digests[1]);
  }
}

TEST(PhasesReplay, PhasesOfNoParticleAreReported) {
  const support::TemporaryFolder folder;
  WritePhases(folder.Path("frame.csv"));
  ServerProgram server;
  const Ran ran = RunPartiemc({"replay", folder.Path("frame.csv"), "--spacing", "1", "--phases",
                               "type=1,5", "--server", server.address()});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.error, HasSubstr("partiemc: --phases type=5: no particle has this value\n"));
}

TEST(PhasesReplay, WrongPhasesAreRefused) {
  const support::TemporaryFolder folder;
  WritePhases(folder.Path("frame.csv"));
  const auto refusal = [&](const std::vector<std::string>& flags, int exit_code) {
    std::vector<std::string> all = {"replay", folder.Path("frame.csv"), "--local", "--spacing",
                                    "1"};
    all.insert(all.end(), flags.begin(), flags.end());
    const Ran ran = RunPartiemc(all);
    EXPECT_EQ(ran.exit_code, exit_code) << ran.error;
    return ran.error;
  };
  EXPECT_THAT(refusal({"--phases", "1,2"}, 2), HasSubstr("type=1,2"));
  EXPECT_THAT(refusal({"--phases", "type=1.5"}, 2), HasSubstr("type=1,2"));
  EXPECT_THAT(refusal({"--phases", "type=1,1"}, 2), HasSubstr("--phases"));
  EXPECT_THAT(refusal({"--phases", "kind=1"}, 3), HasSubstr("there is no column 'kind'; "));
  EXPECT_THAT(refusal({"--phases", "type=1", "--placement", "qef"}, 2), HasSubstr("--phases"));
  // The first reason is the last one: no other flag, such as --slice, would help.
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--surface", "--phases", "type=1"},
        {"--surface", "--phases", "type=1", "--slice", "z=0"}}) {
    EXPECT_THAT(refusal(flags, 2), HasSubstr("--phases: 1; must be absent for a surface"));
  }
}

}  // namespace
}  // namespace partiemc::client
