// The C interface as used by programs in C and Fortran, in process and with a real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/program.h"
#include "support/temporary_folder.h"

namespace partiemc::client {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::StartsWith;

Ran RunFile(const std::string& name, const std::vector<std::string>& arguments) {
  Program program(name, arguments);
  const int exit_code = program.Wait();
  return {exit_code, program.Out(), program.Error()};
}

// The last `length` letters of each line: its digests.
std::vector<std::string> DigestsOf(const std::string& text, std::size_t length = 33) {
  std::vector<std::string> digests;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    for (char& letter : line) letter = static_cast<char>(std::tolower(letter));
    digests.push_back(line.size() < length ? line : line.substr(line.size() - length));
  }
  return digests;
}

// Digests of `partiemc replay` for the particles of the examples.
std::vector<std::string> DigestsOfReplay() {
  const support::TemporaryFolder folder;
  for (int step = 0; step < 5; ++step) {
    std::ofstream file(folder.Path("frame_" + std::to_string(step) + ".csv"));
    file.precision(17);
    file << "x,y\n";
    for (int k = 0; k < 800; ++k) {
      const int column = k % 20, row = k / 20;
      file << 0.01 * column + 0.002 * step * (40 - row) / 16 << ',' << 0.01 * row << '\n';
    }
  }
  const Ran ran = RunPartiemc({"replay", folder.Path("frame_*.csv"), "--local", "--spacing", "0.01",
                               "--stats", folder.Path("statistics.csv")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  std::ifstream file(folder.Path("statistics.csv"));
  const auto cells = [&file] {
    std::string line, cell;
    std::getline(file, line);
    std::vector<std::string> found;
    for (std::istringstream row(line); std::getline(row, cell, ',');) found.push_back(cell);
    return found;
  };
  const std::vector<std::string> header = cells();
  const auto column = [&header](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(header, name) - header.begin());
  };
  std::vector<std::string> digests;
  for (auto row = cells(); row.size() > column("mesh_digest"); row = cells()) {
    digests.push_back(row[column("rings_digest")] + " " + row[column("mesh_digest")]);
  }
  return digests;
}

TEST(CInterface, EveryCallDoesWhatTheHeaderSaysInProcess) {
  const Ran ran = RunFile(C_CALLS, {});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(ran.out, "all is as the header says\n");
}

TEST(CInterface, EveryCallDoesWhatTheHeaderSaysWithAServer) {
  const ServerProgram server;
  const Ran ran = RunFile(C_CALLS, {server.address()});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(ran.out, "all is as the header says\n");
}

TEST(CInterface, TheExampleDrawsAndGivesTheDigestsOfReplay) {
  const support::TemporaryFolder folder;
  const std::string picture = folder.Path("outline.svg");
  const std::vector<std::string> expected = DigestsOfReplay();
  EXPECT_THAT(expected, SizeIs(5));
  const Ran local = RunFile(C_EXAMPLE, {picture});
  EXPECT_EQ(local.exit_code, 0) << local.error;
  EXPECT_EQ(DigestsOf(local.out), expected);
  const ServerProgram server;
  const Ran remote = RunFile(C_EXAMPLE, {folder.Path("remote.svg"), server.address()});
  EXPECT_EQ(remote.out, local.out);
  EXPECT_THAT(Content(picture), testing::MatchesRegex("<svg .*<path d='M[-0-9. LMe]*Z'/></svg>\n"));
  EXPECT_EQ(Content(folder.Path("remote.svg")), Content(picture));

  const Ran nowhere = RunFile(C_EXAMPLE, {picture, "unix:/nowhere.sock"});
  EXPECT_EQ(nowhere.exit_code, 14);  // UNAVAILABLE.
  EXPECT_THAT(nowhere.error, HasSubstr("/nowhere.sock"));
}

// Digests of `partiemc replay` for the particles of the example of surfaces.
std::vector<std::string> SurfaceDigestsOfReplay() {
  const support::TemporaryFolder folder;
  for (int step = 0; step < 5; ++step) {
    std::ofstream file(folder.Path("frame_" + std::to_string(step) + ".csv"));
    file.precision(17);
    file << "x,y,z\n";
    const auto add_ball = [&file](int radius, double centre, double height) {
      for (int x = -radius; x <= radius; ++x) {
        for (int y = -radius; y <= radius; ++y) {
          for (int z = -radius; z <= radius; ++z) {
            if (x * x + y * y + z * z > radius * radius) continue;
            file << centre + 0.01 * x << ',' << 0.01 * y << ',' << height + 0.01 * z << '\n';
          }
        }
      }
    };
    add_ball(6, 0, -0.002 * step * step);
    add_ball(2, 0.1, 0);
  }
  const Ran ran = RunPartiemc({"replay", folder.Path("frame_*.csv"), "--local", "--surface",
                               "--spacing", "0.01", "--stats", folder.Path("statistics.csv")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  return Column(Content(folder.Path("statistics.csv")), "surface_digest");
}

// The lines of the triangles of an OBJ file.
std::vector<std::string> FacesOf(const std::string& path) {
  std::vector<std::string> faces;
  std::istringstream lines(Content(path));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("f ")) faces.push_back(line);
  }
  return faces;
}

TEST(CInterface, ExampleOfSurfacesGivesDigestsOfReplay) {
  const support::TemporaryFolder folder;
  const Ran local = RunFile(C_SURFACE, {folder.Path("local.obj")});
  EXPECT_EQ(local.exit_code, 0) << local.error;
  EXPECT_EQ(DigestsOf(local.out, 16), SurfaceDigestsOfReplay());
  EXPECT_THAT(local.out, StartsWith("2 bodies, volume 0.0009"));
  const ServerProgram server;
  const Ran remote = RunFile(C_SURFACE, {folder.Path("remote.obj"), server.address()});
  EXPECT_EQ(remote.out, local.out);
  const std::string body = Content(folder.Path("local.obj"));
  const auto lines_with = [&body](const char* begin) {
    std::size_t count = 0;
    std::istringstream lines(body);
    for (std::string line; std::getline(lines, line);) count += line.starts_with(begin) ? 1 : 0;
    return count;
  };
  // Two bodies without handles: V - T / 2 = 4.
  EXPECT_GT(lines_with("f "), 1000u);
  EXPECT_EQ(lines_with("v "), lines_with("f ") / 2 + 4);
  EXPECT_EQ(lines_with("vn "), lines_with("v "));
  EXPECT_TRUE(Content(folder.Path("remote.obj")) == body);
}

TEST(CInterface, ExamplesInFortranGiveDigestsOfReplay) {
  if (std::string(FORTRAN_EXAMPLE).empty()) {
    GTEST_SKIP() << "NOT TESTED: there is no Fortran compiler (Debian: gfortran)";
  }
  const Ran ran = RunFile(FORTRAN_EXAMPLE, {});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(DigestsOf(ran.out), DigestsOfReplay());

  const support::TemporaryFolder folder;
  const Ran in_space = RunFile(FORTRAN_SURFACE, {folder.Path("fortran.obj")});
  EXPECT_EQ(in_space.exit_code, 0) << in_space.error;
  EXPECT_EQ(DigestsOf(in_space.out, 16), SurfaceDigestsOfReplay());
  EXPECT_EQ(RunFile(C_SURFACE, {folder.Path("c.obj")}).exit_code, 0);
  EXPECT_EQ(FacesOf(folder.Path("fortran.obj")), FacesOf(folder.Path("c.obj")));
}

TEST(CInterface, TheLibraryShowsItsFunctionsAndNothingElse) {
  const Ran ran = RunFile("/usr/bin/nm", {"--dynamic", "--defined-only", "--format=just-symbols",
                                          "--without-symbol-versions", C_LIBRARY});
  ASSERT_EQ(ran.exit_code, 0) << ran.error;
  std::vector<std::string> symbols;
  std::istringstream lines(ran.out);
  for (std::string line; std::getline(lines, line);) {
    if (line != "PARTIEMC_1") symbols.push_back(line);  // The version node.
  }
  EXPECT_THAT(symbols, SizeIs(18));
  EXPECT_THAT(symbols, Each(StartsWith("partiemc_")));
  const Ran dynamic = RunFile("/usr/bin/readelf", {"--dynamic", C_LIBRARY});
  EXPECT_THAT(dynamic.out, HasSubstr("soname: [libpartiemc_c.so.1]"));
  EXPECT_THAT(dynamic.out, testing::Not(HasSubstr("libpartiemc_client")));
}

}  // namespace
}  // namespace partiemc::client
