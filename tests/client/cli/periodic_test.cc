// `partiemc replay --periodic` as a program, with boxes of LAMMPS dumps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A disc of radius 6 that moves through the corner of a box of 30 x 20, wrapped by image flags.
void WriteDump(const std::string& path,
               const std::string& bounds = "pp pp pp\n-10 20\n5 25\n-1 1\n") {
  std::ofstream file(path);
  for (int frame = 0; frame < 3; ++frame) {
    std::string atoms;
    int count = 0;
    for (int i = -6; i <= 6; ++i) {
      for (int j = -6; j <= 6; ++j) {
        if (i * i + j * j > 36) continue;
        const int x = 18 + i + 2 * frame, y = 24 + j + 2 * frame;
        const int image_x = x >= 20 ? 1 : 0, image_y = y >= 25 ? 1 : 0;
        atoms += std::to_string(++count) + " " + std::to_string(x - 30 * image_x) + " " +
                 std::to_string(y - 20 * image_y) + " " + std::to_string(image_x) + " " +
                 std::to_string(image_y) + "\n";
      }
    }
    file << "ITEM: TIMESTEP\n"
         << frame << "\nITEM: NUMBER OF ATOMS\n"
         << count << "\nITEM: BOX BOUNDS " << bounds << "ITEM: ATOMS id x y ix iy\n"
         << atoms;
  }
}

struct Columns {
  std::vector<std::string> rings, area, digest;
};

Columns Replayed(const std::string& dump, std::vector<std::string> more) {
  const support::TemporaryFolder output;
  more.insert(more.begin(), {"replay", dump, "--spacing", "1", "--stats", output.Path("s.csv")});
  const Ran ran = RunPartiemc(more);
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  const std::string stats = Content(output.Path("s.csv"));
  return {Column(stats, "polylines"), Column(stats, "area"), Column(stats, "rings_digest")};
}

TEST(PeriodicReplay, DiscAcrossCornerIsOneBody) {
  const support::TemporaryFolder input;
  const std::string dump = input.Path("disc.lammpstrj");
  WriteDump(dump);
  // By the names of the columns, positions stay wrapped: the faces cut the disc.
  const std::vector<std::string> wrapped = {"--local", "--columns", "x,y"};
  EXPECT_THAT(Replayed(dump, wrapped).rings, ElementsAre("4", "4", "4"));
  std::vector<std::string> periodic = wrapped;
  periodic.insert(periodic.end(), {"--periodic", "x,y", "--check"});
  const Columns whole = Replayed(dump, periodic);
  EXPECT_THAT(whole.rings, ElementsAre("1", "1", "1"));
  const Columns open = Replayed(dump, {"--local"});  // Unwrapped by its image flags.
  ASSERT_EQ(open.area.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::stod(whole.area.at(k)), std::stod(open.area[k]),
                1e-6 * std::stod(open.area[k]));
  }
  // --box replaces the box of the dump; the unwrapped particles are wrapped again.
  const Columns same =
      Replayed(dump, {"--local", "--periodic", "x,y", "--box", "-10,20,5,25", "--fill", "greedy"});
  EXPECT_EQ(same.rings, whole.rings);
  // A server gives the same bits.
  ServerProgram server;
  EXPECT_EQ(Replayed(dump, {"--server", server.address(), "--columns", "x,y", "--periodic", "x,y"})
                .digest,
            whole.digest);
}

// A disc across the corner of a box that grows by 1 % a frame, and a layer, as of LAMMPS `fix npt`.
TEST(PeriodicReplay, FramesHaveTheirOwnBoxes) {
  const support::TemporaryFolder folder;
  const std::string dump = folder.Path("npt.lammpstrj");
  std::ofstream file(dump);
  for (int frame = 0; frame < 4; ++frame) {
    const double length = 60 * std::pow(1.01, frame), low = -.5 * length;
    std::string atoms;
    int count = 0;
    for (int i = -6; i <= 6; ++i) {
      for (int j = -6; j <= 6; ++j) {
        if (i * i + j * j > 36) continue;
        const double x = i / 60. - std::floor(i / 60.), y = j / 60. - std::floor(j / 60.);
        atoms += std::to_string(++count) + " " + std::to_string(x) + " " + std::to_string(y) + "\n";
      }
    }
    for (int k = 0; k < 240; ++k) {
      atoms += std::to_string(++count) + " " + std::to_string((k % 60 + .5) / 60) + " " +
               std::to_string((k / 60 + 28) / 60.) + "\n";
    }
    file << "ITEM: TIMESTEP\n"
         << frame << "\nITEM: NUMBER OF ATOMS\n"
         << count << "\nITEM: BOX BOUNDS pp pp pp\n";
    for (int axis = 0; axis < 2; ++axis) file << low << " " << low + length << "\n";
    file << "-1 1\nITEM: ATOMS id xs ys\n" << atoms;
  }
  file.close();
  std::vector<std::string> flags = {"--local", "--periodic", "x,y", "--check"};
  const Columns local = Replayed(dump, flags);
  EXPECT_THAT(local.rings, ElementsAre("2", "2", "2", "2"));
  ServerProgram server;
  EXPECT_EQ(Replayed(dump, {"--server", server.address(), "--periodic", "x,y"}).digest,
            local.digest);
  // One box for all frames cuts the disc and the layer elsewhere.
  const Columns fixed = Replayed(dump, {"--local", "--periodic", "x,y", "--box", "-30,30,-30,30"});
  EXPECT_EQ(fixed.digest[0], local.digest[0]);
  EXPECT_NE(fixed.digest[3], local.digest[3]);
}

// A layer of 30 x 6 particles across the periodic faces.
TEST(PeriodicReplay, LayerIsCutAtTheFaces) {
  const support::TemporaryFolder folder;
  const std::string csv = folder.Path("layer.csv");
  std::ofstream file(csv);
  file << "x,y\n";
  for (int k = 0; k < 180; ++k) file << k % 30 + .5 << "," << k / 30 << "\n";
  file.close();
  const std::vector<std::string> flags = {"--periodic", "x", "--box", "0,30,0,30"};
  std::vector<std::string> local = {"--local", "--check",      "--format",
                                    "svg",     "--output-dir", folder.Path("out")};
  local.insert(local.end(), flags.begin(), flags.end());
  const Columns cut = Replayed(csv, local);
  ASSERT_THAT(cut.rings, ElementsAre("1"));
  EXPECT_NEAR(std::stod(cut.area[0]), 180, 1e-6);
  ServerProgram server;
  std::vector<std::string> remote = {"--server", server.address()};
  remote.insert(remote.end(), flags.begin(), flags.end());
  EXPECT_EQ(Replayed(csv, remote).digest, cut.digest);
}

// A layer on two rows of wall particles, or on a line, with an obstacle across the periodic face.
TEST(PeriodicReplay, WallsAreCutAtTheFaces) {
  const support::TemporaryFolder folder;
  const std::string csv = folder.Path("layer.csv");
  std::ofstream file(csv);
  file << "x,y,type\n";
  for (int k = 0; k < 360; ++k) {
    const int x = k % 30, y = k / 30 - 2;
    if (y >= 0 && y < 4 && (x < 3 || x >= 27)) continue;
    file << x + .5 << "," << y + .5 << "," << (y < 0 ? 2 : 1) << "\n";
  }
  file.close();
  ServerProgram server;
  for (const std::string wall : {"type=2", "0,0,1,0"}) {
    SCOPED_TRACE(wall);
    const std::vector<std::string> flags = {"--periodic", "x",  "--box",  "0,30,0,30",
                                            "--wall",     wall, "--wall", "-3,0,-3,4,3,4,3,0"};
    std::vector<std::string> local = {"--local", "--check"};
    local.insert(local.end(), flags.begin(), flags.end());
    const Columns cut = Replayed(csv, local);
    ASSERT_THAT(cut.rings, ElementsAre("1"));
    EXPECT_NEAR(std::stod(cut.area[0]), 300 - 24, 2);
    std::vector<std::string> remote = {"--server", server.address()};
    remote.insert(remote.end(), flags.begin(), flags.end());
    EXPECT_EQ(Replayed(csv, remote).digest, cut.digest);
  }
}

TEST(PeriodicReplay, WrongBoxesAreRefused) {
  const support::TemporaryFolder input;
  const auto refusal = [&](const std::string& bounds, const std::vector<std::string>& flags,
                           int exit_code) {
    const std::string dump = input.Path("disc.lammpstrj");
    WriteDump(dump, bounds);
    std::vector<std::string> all = {"replay", dump, "--local", "--spacing", "1"};
    all.insert(all.end(), flags.begin(), flags.end());
    const Ran ran = RunPartiemc(all);
    EXPECT_EQ(ran.exit_code, exit_code) << ran.error;
    return ran.error;
  };
  const std::string plain = "pp pp pp\n-10 20\n5 25\n-1 1\n";
  EXPECT_THAT(refusal("pp ff pp\n-10 20\n5 25\n-1 1\n", {"--periodic", "x,y"}, 2),
              HasSubstr("it is not along y"));
  EXPECT_THAT(refusal("xy xz yz pp pp pp\n-10 20 1\n5 25 0\n-1 1 0\n", {"--periodic", "x"}, 3),
              HasSubstr("triclinic"));
  EXPECT_THAT(refusal(plain, {"--periodic", "z"}, 2), HasSubstr("--surface"));
  EXPECT_THAT(refusal(plain, {"--periodic", "x", "--box", "0,9"}, 2), HasSubstr("X0,X1,Y0,Y1"));
  EXPECT_THAT(refusal(plain, {"--surface", "--periodic", "x,z", "--box", "0,9,0,9"}, 2),
              HasSubstr("--box: '0,9,0,9'; must be X0,X1,Y0,Y1,Z0,Z1"));
  EXPECT_THAT(refusal(plain, {"--periodic", "x", "--box", "0,9,0,9"}, 2),
              HasSubstr("four kernel radii"));
  EXPECT_THAT(refusal(plain, {"--box", "0,30,0,30"}, 2), HasSubstr("--periodic"));
}

// A disc across the corner of the box of an extended XYZ file.
TEST(PeriodicReplay, LatticesOfExtendedXyzAreBoxes) {
  const support::TemporaryFolder folder;
  const std::string xyz = folder.Path("disc.xyz");
  std::string atoms;
  int count = 0;
  for (int i = -6; i <= 6; ++i) {
    for (int j = -6; j <= 6; ++j) {
      if (i * i + j * j > 36) continue;
      ++count;
      atoms += "A " + std::to_string((i + 30) % 30) + " " + std::to_string((j + 30) % 30) + " 0\n";
    }
  }
  const auto write = [&](const std::string& comment) {
    std::ofstream(xyz) << count << "\n" << comment << "\n" << atoms;
  };
  write("Lattice=\"30 0 0 0 30 0 0 0 1\" Properties=species:S:1:pos:R:3");
  EXPECT_THAT(Replayed(xyz, {"--local"}).rings, ElementsAre("4"));
  const Columns whole = Replayed(xyz, {"--local", "--periodic", "x,y"});
  EXPECT_THAT(whole.rings, ElementsAre("1"));
  EXPECT_EQ(Replayed(xyz, {"--local", "--periodic", "x,y", "--box", "0,30,0,30"}).digest,
            whole.digest);
  // A recording keeps the box.
  const std::string recording = folder.Path("disc.pemc");
  ASSERT_EQ(RunPartiemc({"convert", xyz, recording}).exit_code, 0);
  EXPECT_EQ(Replayed(recording, {"--local", "--periodic", "x,y"}).digest, whole.digest);

  const auto refusal = [&](const std::string& comment, int exit_code) {
    write(comment);
    const Ran ran = RunPartiemc({"replay", xyz, "--local", "--spacing", "1", "--periodic", "x,y"});
    EXPECT_EQ(ran.exit_code, exit_code) << ran.error;
    return ran.error;
  };
  EXPECT_THAT(refusal("Lattice=\"30 0 0 9 30 0 0 0 1\"", 3), HasSubstr("triclinic"));
  EXPECT_THAT(refusal("Lattice=\"30 0 0 0 30 0 0 0 1\" pbc=\"T F F\"", 2),
              HasSubstr("it is not along y"));
  EXPECT_THAT(refusal("Lattice=\"30 0 0 0 30 0\"", 3), HasSubstr("no box for --periodic"));
}

TEST(PeriodicReplay, LaterBoxesWithoutThePeriodicAxisAreRefused) {
  const support::TemporaryFolder folder;
  const std::string dump = folder.Path("opened.lammpstrj"), csv = folder.Path("no_box.csv");
  std::ofstream file(dump);
  for (const std::string_view y : {"pp", "pp", "ff"}) {
    file << "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp " << y
         << " pp\n0 30\n0 30\n-1 1\nITEM: ATOMS id x y\n1 2 3\n2 3 3\n";
  }
  file.close();
  std::ofstream(csv) << "x,y\n1,2\n2,2\n";
  const auto run = [&](const std::string& input, const std::string& axes) {
    return RunPartiemc({"replay", input, "--local", "--spacing", "1", "--periodic", axes});
  };
  EXPECT_EQ(run(dump, "x").exit_code, 0) << "x is periodic in all frames";
  const Ran opened = run(dump, "x,y");
  EXPECT_EQ(opened.exit_code, 3);
  EXPECT_THAT(opened.error, AllOf(HasSubstr("frame 2"), HasSubstr("other axes")));
  const Ran no_box = run(csv, "x");
  EXPECT_EQ(no_box.exit_code, 3);
  EXPECT_THAT(no_box.error, HasSubstr("no box for --periodic; give --box"));
}

}  // namespace
}  // namespace partiemc::client
