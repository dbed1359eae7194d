// `partiemc replay --wall` as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// A column of 20 x 15 particles in the left corner of a tank.
constexpr const char* kTank = "0,0,40,0,40,30,0,30";

void WriteColumn(const std::string& path) {
  std::ofstream file(path);
  file << "x,y\n";
  for (int k = 0; k < 300; ++k) file << k % 20 + .5 << "," << k / 20 + .5 << "\n";
}

Ran RanReplay(const std::string& input, std::vector<std::string> more) {
  more.insert(more.begin(), {"replay", input, "--spacing", "1"});
  return RunPartiemc(more);
}

TEST(WallsReplay, ColumnWetsTheTank) {
  const support::TemporaryFolder folder;
  WriteColumn(folder.Path("column.csv"));
  ServerProgram server;
  std::vector<std::string> digests, files;
  for (const std::vector<std::string>& where :
       {std::vector<std::string>{"--local", "--check"}, {"--server", server.address()}}) {
    const std::string out = folder.Path("out" + std::to_string(digests.size()));
    std::vector<std::string> flags = {"--wall",   kTank,     "--stats",      folder.Path("s.csv"),
                                      "--format", "csv,svg", "--output-dir", out};
    flags.insert(flags.end(), where.begin(), where.end());
    const Ran ran = RanReplay(folder.Path("column.csv"), flags);
    ASSERT_EQ(ran.exit_code, 0) << ran.error;
    const std::string stats = Content(folder.Path("s.csv"));
    digests.push_back(Column(stats, "rings_digest").at(0));
    EXPECT_NEAR(std::stod(Column(stats, "wetted_length").at(0)), 35, 2);
    EXPECT_EQ(Column(stats, "contacts").at(0), "2");
    EXPECT_NEAR(std::stod(Column(stats, "contact_angle").at(0)), 90, 20);
    files.push_back(Content(out + "/frame_000000.csv"));
    EXPECT_THAT(Content(out + "/frame_000000.svg"), HasSubstr("class=\"contacts\""));
  }
  EXPECT_EQ(digests[0], digests[1]);
  EXPECT_EQ(files[0], files[1]);
  // Wetted points lie on the floor or on the left side, bit for bit.
  const auto x = Column(files[0], "x"), y = Column(files[0], "y");
  const auto wetted = Column(files[0], "wetted");
  std::size_t count = 0;
  for (std::size_t k = 0; k < wetted.size(); ++k) {
    if (wetted[k] != "1") continue;
    ++count;
    EXPECT_TRUE(std::stod(x[k]) == 0 || std::stod(y[k]) == 0) << x[k] << " " << y[k];
  }
  EXPECT_GT(count, 2u);
}

TEST(WallsReplay, WithoutWallsFilesAreAsBefore) {
  const support::TemporaryFolder folder;
  WriteColumn(folder.Path("column.csv"));
  const Ran ran =
      RanReplay(folder.Path("column.csv"), {"--local", "--stats", folder.Path("s.csv"), "--format",
                                            "csv,svg", "--output-dir", folder.Path("out")});
  ASSERT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(Content(folder.Path("s.csv")), HasSubstr(",section\n"));
  EXPECT_THAT(Content(folder.Path("out/frame_000000.csv")), HasSubstr("ring,index,x,y,nx,ny\n"));
  EXPECT_THAT(Content(folder.Path("out/frame_000000.svg")), Not(HasSubstr("contacts")));
}

// A tank of particles, of which the last row of the fluid is the eighth.
TEST(WallsReplay, ParticlesOfATypeAreATank) {
  const support::TemporaryFolder folder;
  {
    std::ofstream file(folder.Path("tank.csv"));
    file << "x,y,type\n";
    for (int i = -2; i < 22; ++i) {
      for (int j = -2; j < 14; ++j) {
        const bool is_wall = i < 0 || i >= 20 || j < 0;
        if (is_wall || j < 8) {
          file << i + .5 << "," << j + .5 << "," << (is_wall ? 3 : 1) << "\n";
        }
      }
    }
  }
  ServerProgram server;
  std::vector<std::string> digests;
  for (const std::vector<std::string>& where :
       {std::vector<std::string>{"--local", "--check"}, {"--server", server.address()}}) {
    std::vector<std::string> flags = {"--wall", "type=3", "--stats", folder.Path("s.csv")};
    flags.insert(flags.end(), where.begin(), where.end());
    const Ran ran = RanReplay(folder.Path("tank.csv"), flags);
    ASSERT_EQ(ran.exit_code, 0) << ran.error;
    const std::string stats = Content(folder.Path("s.csv"));
    digests.push_back(Column(stats, "rings_digest").at(0));
    EXPECT_NEAR(std::stod(Column(stats, "area").at(0)), 160, 2);
    EXPECT_EQ(Column(stats, "contacts").at(0), "2");
    EXPECT_NEAR(std::stod(Column(stats, "wetted_length").at(0)), 36, 1);
  }
  EXPECT_EQ(digests[0], digests[1]);
}

// Repeated flags, also with a negative first coordinate, are walls in their order.
TEST(WallsReplay, ReportListsTheWalls) {
  const support::TemporaryFolder folder;
  WriteColumn(folder.Path("column.csv"));
  const Ran ran = RanReplay(folder.Path("column.csv"),
                            {"--local", "--wall", "-1,0,1,0", "--wall", "28,4,28,8,32,8,32,4",
                             "--report", folder.Path("report.html")});
  ASSERT_EQ(ran.exit_code, 0) << ran.error;
  const std::string report = Content(folder.Path("report.html"));
  EXPECT_THAT(report, HasSubstr("wall 1</th><td>-1,0,1,0</td>"));
  EXPECT_THAT(report, HasSubstr("wall 2</th><td>28,4,28,8,32,8,32,4</td>"));
}

TEST(WallsReplay, BlockFillsItsTankInSpace) {
  const support::TemporaryFolder folder;
  std::ofstream file(folder.Path("block.csv"));
  file << "x,y,z\n";
  for (int k = 0; k < 720; ++k) {
    file << k % 10 + .5 << "," << k / 10 % 9 + .5 << "," << k / 90 + .5 << "\n";
  }
  file.close();
  const Ran ran =
      RanReplay(folder.Path("block.csv"),
                {"--local", "--surface", "--wall-plane", "z=0", "--wall-plane", "x=10,below",
                 "--wall-plane", "x=0,above", "--wall-plane", "y=0", "--wall-plane", "y=9,below",
                 "--format", "obj", "--output-dir", folder.Path("out")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  for (const std::string text : {"w=0", "z", "z=", "z=1,2", "z=x", "z=0,beside", ""}) {
    const Ran wrong = RanReplay(folder.Path("block.csv"), {"--local", "--wall-plane", text});
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_THAT(wrong.error, HasSubstr("--wall-plane"));
  }
  const Ran twice = RanReplay(folder.Path("block.csv"), {"--local", "--surface", "--wall-plane",
                                                         "z=0", "--wall-plane", "z=1"});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_THAT(twice.error, HasSubstr("--wall-plane number 2: "));
  const Ran outline = RanReplay(folder.Path("block.csv"), {"--local", "--wall-plane", "z=0"});
  EXPECT_EQ(outline.exit_code, 2);
  EXPECT_THAT(outline.error, HasSubstr("--wall-plane: "));
}

TEST(WallsReplay, WallsThatLeaveNothingAreTold) {
  const support::TemporaryFolder folder;
  {
    std::ofstream file(folder.Path("column.csv"));
    file << "x,y\n";
    for (int k = 0; k < 100; ++k) file << k % 10 + .5 << "," << k / 10 + .5 << "\n";
  }
  const Ran ran = RunPartiemc({"replay", folder.Path("column.csv"), "--local", "--spacing", "1",
                               "--check", "--wall", "0,0,0,20,10,20,10,0"});  // Clockwise.
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(
      ran.error,
      AllOf(HasSubstr("in 1 of 1 frame: walls-hide-fluid: most of the fluid is behind walls"),
            HasSubstr("no frame has an outline\n")));
}

TEST(WallsReplay, WallsBeforeMostParticlesAreTold) {
  const support::TemporaryFolder folder;
  std::ofstream file(folder.Path("column.csv"));
  std::ofstream block(folder.Path("block.csv"));
  file << "x,y\n";
  block << "x,y,z\n";
  for (int k = 0; k < 400; ++k) file << k % 20 + .5 << "," << k / 20 + .5 << "\n";
  for (int k = 0; k < 512; ++k) {
    block << k % 8 + .5 << "," << k / 8 % 8 + .5 << "," << k / 64 + .5 << "\n";
  }
  file.close();
  block.close();
  const auto error = [&](const std::string& name, std::vector<std::string> flags) {
    flags.insert(flags.end(), {"--local", "--quiet"});
    const Ran ran = RanReplay(folder.Path(name), flags);
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    return ran.error;
  };
  // Clockwise, so an obstacle, from the height 4: sixteen of twenty rows are in it.
  EXPECT_THAT(error("column.csv", {"--wall", "0,0,1,0", "--wall", "0,4,0,20,20,20,20,4"}),
              HasSubstr("walls-hide-fluid"));
  EXPECT_THAT(error("column.csv", {"--wall", "0,8,20,8,20,20,0,20"}), IsEmpty());
  EXPECT_THAT(error("column.csv", {"--wall", "20,12,0,12"}), IsEmpty());
  EXPECT_THAT(error("column.csv", {"--wall", "20,4,0,4"}), HasSubstr("walls-hide-fluid"));
  EXPECT_THAT(error("block.csv", {"--surface", "--wall-plane", "z=7"}),
              HasSubstr("walls-hide-fluid"));
  EXPECT_THAT(error("block.csv", {"--surface", "--wall-plane", "z=5,below"}), IsEmpty());
}

TEST(WallsReplay, WallsOfNoParticleAreReported) {
  const support::TemporaryFolder folder;
  for (const int frame : {0, 1}) {
    std::ofstream file(folder.Path("column_" + std::to_string(frame) + ".csv"));
    file << "x,y,type\n";
    // In frame 0 the lowest row is of type 1, in frame 1 of type 2.
    for (int k = 0; k < 100; ++k) {
      file << k % 10 + .5 << "," << k / 10 + .5 << "," << (k < 10 ? 1 + frame : 3) << "\n";
    }
  }
  const auto errors = [&](std::vector<std::string> walls) {
    std::vector<std::string> all = {
        "replay", folder.Path("column_*.csv"), "--local", "--spacing", "1", "--quiet"};
    all.insert(all.end(), walls.begin(), walls.end());
    const Ran ran = RunPartiemc(all);
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    return ran.error;
  };
  EXPECT_EQ(errors({"--wall", "type=1,2"}), "");
  EXPECT_EQ(errors({"--wall", "type=7"}), "partiemc: --wall type=7: no particle has this value\n");
  EXPECT_EQ(errors({"--wall", "type=1,8", "--wall", "type=9"}),
            "partiemc: --wall type=8,9: no particle has one of these values\n");
}

TEST(WallsReplay, WrongWallsAreRefused) {
  const support::TemporaryFolder folder;
  WriteColumn(folder.Path("column.csv"));
  const auto refusal = [&](std::vector<std::string> flags) {
    flags.push_back("--local");
    const Ran ran = RanReplay(folder.Path("column.csv"), flags);
    EXPECT_EQ(ran.exit_code, 2) << ran.error;
    return ran.error;
  };
  for (const std::string text : {"0,0", "0,0,1", "0,0,1,0,1", "0,0,1,x", "0,0,1,inf"}) {
    EXPECT_THAT(refusal({"--wall", text}),
                HasSubstr("--wall: '" + text + "'; must be X0,Y0,X1,Y1,...: two points or more"));
  }
  EXPECT_THAT(refusal({"--wall", "y=0"}), HasSubstr("such as 0,0,1,0 for the floor y = 0"));
  EXPECT_THAT(refusal({"--wall-plane", "z=0"}), HasSubstr("used with --surface"));
  for (const std::string text : {"type=", "type=1.5", "=1"}) {
    EXPECT_THAT(refusal({"--wall", text}), HasSubstr("type=2"));
  }
  EXPECT_THAT(refusal({"--wall", "type=1", "--wall", "kind=2"}), HasSubstr("one attribute"));
  EXPECT_THAT(refusal({"--wall", "type=1,1"}), HasSubstr("--wall"));
  std::string many = "0,0";
  for (int k = 1; k <= 1024; ++k) many += "," + std::to_string(k) + "," + std::to_string(k * k);
  EXPECT_THAT(refusal({"--wall", many}), HasSubstr("partiemc: --wall: "));
  // These break rules of the core.
  EXPECT_THAT(refusal({"--wall", "1,2,1,2"}), HasSubstr("partiemc: --wall number 1: "));
  EXPECT_THAT(refusal({"--wall", kTank, "--wall", "0,0,4,4,4,0,0,4"}),
              HasSubstr("partiemc: --wall number 2: "));
  for (const std::vector<std::string>& other :
       {std::vector<std::string>{"--placement", "qef"}, {"--isolines", ".5"}}) {
    std::vector<std::string> flags = {"--wall", kTank};
    flags.insert(flags.end(), other.begin(), other.end());
    EXPECT_THAT(refusal(flags), HasSubstr("partiemc: --wall: present; ")) << other[0];
  }
  const auto in_box = [&](const std::string& wall) {
    return refusal({"--wall", wall, "--periodic", "x", "--box", "0,40,0,40"});
  };
  EXPECT_THAT(in_box(kTank), HasSubstr("endless lines"));
  EXPECT_THAT(in_box("0,0,1,.1"), HasSubstr("parallel to the periodic axis"));
  EXPECT_THAT(
      refusal({"--surface", "--wall-plane", "x=0", "--periodic", "x", "--box", "0,40,0,40,0,40"}),
      HasSubstr("--wall-plane number 1"));
}

}  // namespace
}  // namespace partiemc::client
