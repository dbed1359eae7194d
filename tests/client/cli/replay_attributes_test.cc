// `partiemc replay` with attributes of particles, as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// A block of particles with a linear attribute and a linear velocity.
void WriteLinearFields(const support::TemporaryFolder& directory) {
  std::ofstream file(directory.Path("frame_0.csv"));
  file << "x,y,vx,vy,p\n";
  for (int row = 0; row < 20; ++row) {
    for (int column = 0; column < 20; ++column) {
      file << column << "," << row << "," << 2 * row << "," << -column << "," << 3 * column - row
           << "\n";
    }
  }
}

void ExpectLinearFields(const std::string& csv) {
  const auto x = Column(csv, "x"), y = Column(csv, "y"), p = Column(csv, "p");
  const auto u = Column(csv, "velocity:0"), v = Column(csv, "velocity:1");
  ASSERT_GT(x.size(), 40);
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double at_x = std::stod(x[k]), at_y = std::stod(y[k]);
    EXPECT_NEAR(std::stod(p[k]), 3 * at_x - at_y, .6) << "1 % of the range, 76";
    EXPECT_NEAR(std::stod(u[k]), 2 * at_y, .4);
    EXPECT_NEAR(std::stod(v[k]), -at_x, .2);
  }
}

TEST(Replay, WritesAttributesAtTheVerticesOfFilesAndRecordings) {
  const support::TemporaryFolder directory;
  WriteLinearFields(directory);
  const std::vector<std::string> wanted = {"--local", "--attributes", "p,velocity", "--format",
                                           "csv,svg", "--color-by",   "p",          "--quiet"};
  auto replay = [&](const std::string& input, const std::string& output) {
    std::vector<std::string> arguments{
        "replay", directory.Path(input), "--output-dir", directory.Path(output), "--spacing", "1"};
    arguments.insert(arguments.end(), wanted.begin(), wanted.end());
    const Ran ran = RunPartiemc(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    ExpectLinearFields(Content(directory.Path(output + "/frame_000000.csv")));
    return Content(directory.Path(output + "/frame_000000.svg"));
  };
  const std::string from_csv = replay("frame_0.csv", "from_csv");
  EXPECT_THAT(from_csv, HasSubstr("class=\"bands\""));
  const Ran converted = RunPartiemc({"convert", directory.Path("frame_0.csv"),
                                     directory.Path("block.pemc"), "--quiet", "--attributes", "p"});
  ASSERT_EQ(converted.exit_code, 0) << converted.error;
  const Ran again = RunPartiemc(
      {"convert", directory.Path("block.pemc"), directory.Path("again.pemc"), "--quiet"});
  ASSERT_EQ(again.exit_code, 0) << again.error;
  const Ran ran = RunPartiemc({"replay", directory.Path("again.pemc"), "--local", "--spacing", "1",
                               "--attributes", "p", "--output-dir", directory.Path("pemc"),
                               "--format", "csv", "--quiet"});
  ASSERT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(Column(Content(directory.Path("pemc/frame_000000.csv")), "p"),
            Column(Content(directory.Path("from_csv/frame_000000.csv")), "p"));
}

// A drop of 32 particles of another phase, far below the surface.
TEST(Replay, ShowsASubmergedDropInEveryOutput) {
  const support::TemporaryFolder directory;
  std::ofstream file(directory.Path("frame_0.csv"));
  file << "x,y,phase\n";
  for (int row = 0; row < 60; ++row) {
    for (int column = 0; column < 60; ++column) {
      const bool in_drop = std::hypot(column - 30.3, row - 28.6) < 3.2;
      file << column << "," << row << "," << in_drop << "\n";
    }
  }
  file.close();
  struct Seen {
    double triangles, largest;
    std::string svg;
  };
  const auto replay = [&](const std::string& tolerance) {
    const std::string folder = directory.Path("tolerance_" + tolerance);
    const Ran ran = RunPartiemc({"replay",
                                 directory.Path("frame_0.csv"),
                                 "--local",
                                 "--spacing",
                                 "1",
                                 "--attributes",
                                 "phase",
                                 "--color-by",
                                 "phase",
                                 "--format",
                                 "svg",
                                 "--output-dir",
                                 folder,
                                 "--stats",
                                 folder + ".csv",
                                 "--report",
                                 folder + ".html",
                                 "--attribute-tolerance",
                                 tolerance,
                                 "--check",
                                 "--quiet"});
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    Seen seen;
    seen.triangles = std::stod(Column(Content(folder + ".csv"), "triangles").at(0));
    const std::string report = Content(folder + ".html");
    EXPECT_THAT(report, HasSubstr("\"mesh_shown\":true"));
    std::smatch colors;
    const std::string numbers = report.substr(report.find("class=\"frame-numbers\""), 5000);
    EXPECT_TRUE(
        std::regex_search(numbers, colors, std::regex("\"colors\":\\[\\[([^,]+),([^\\]]+)")));
    seen.largest = std::stod(colors[2]);
    seen.svg = Content(folder + "/frame_000000.svg");
    return seen;
  };
  const Seen shown = replay("0.01"), hidden = replay("1");
  EXPECT_GT(shown.largest, .95);
  EXPECT_EQ(hidden.largest, 1) << "particles show the drop in any mesh";
  EXPECT_GT(shown.triangles, hidden.triangles);
  const auto bands = [](const std::string& svg) {
    const std::size_t begin = svg.find("class=\"bands\"");
    const std::string group = svg.substr(begin, svg.find("</g>", begin) - begin);
    return std::ranges::count(group, '\n');
  };
  EXPECT_GT(bands(shown.svg), bands(hidden.svg) + 3);
  const Ran refused = RunPartiemc({"replay", directory.Path("frame_0.csv"), "--local", "--quiet",
                                   "--attribute-tolerance", "1.5"});
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_THAT(refused.error, HasSubstr("--attribute-tolerance"));
}

TEST(Replay, AnAttributeThatIsMissingIsTold) {
  const support::TemporaryFolder directory;
  WriteLinearFields(directory);
  const Ran ran = RunPartiemc(
      {"replay", directory.Path("frame_0.csv"), "--local", "--attributes", "q", "--quiet"});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(ran.error, AllOf(HasSubstr("'q'"), HasSubstr("x,y,vx,vy,p")));
  EXPECT_EQ(RunPartiemc({"replay", "x.pemc", "--local", "--color-by", "q"}).exit_code, 2);
}

}  // namespace
}  // namespace partiemc::client
