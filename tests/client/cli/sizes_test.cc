// `partiemc replay --sizes own` as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Moves x by whole lengths into [low, low + length).
double Wrapped(double x, double low, double length) {
  return x - length * std::floor((x - low) / length);
}

// A square of 20 x 20: on the left particles 2 apart, on the right 1 apart. `column` has their
// diameters times `factor`, to the power of `power`. The square is wrapped into a box of `length`
// from `low` on.
void WriteZones(const std::string& path, const std::string& column, double factor, int power,
                double low = -500, double length = 1000) {
  std::ofstream file(path);
  file.precision(12);
  file << "x,y," << column << "\n";
  const auto add = [&](double x, double y, double size) {
    const double diameter = factor * size;
    file << Wrapped(x, low, length) << "," << Wrapped(y, low, length) << ","
         << (power == 2 ? diameter * diameter : diameter) << "\n";
  };
  for (int j = 0; j < 10; ++j) {
    for (int i = 0; i < 5; ++i) add(2 * i + 1, 2 * j + 1, 2);
  }
  for (int j = 0; j < 20; ++j) {
    for (int i = 0; i < 10; ++i) add(10.5 + i, j + .5, 1);
  }
}

std::string DigestOf(const std::string& input, std::vector<std::string> more) {
  const support::TemporaryFolder output;
  more.insert(more.begin(), {"replay", input, "--stats", output.Path("s.csv")});
  const Ran ran = RunPartiemc(more);
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  const auto digests = Column(Content(output.Path("s.csv")), "rings_digest");
  return digests.empty() ? "" : digests[0];
}

// A block of particles 2 apart beside one of particles 1 apart.
TEST(SizedReplay, SurfacesTakeCubedDiameters) {
  const support::TemporaryFolder input;
  const auto write = [&](const std::string& column, int power) {
    std::ofstream file(input.Path(column + ".csv"));
    file << "x,y,z," << column << "\n";
    for (const int size : {2, 1}) {
      const int count = 8 / size;
      for (int k = 0; k < count * count * count; ++k) {
        const double at[] = {size * (k % count + .5), size * (k / count % count + .5),
                             size * (k / (count * count) + .5)};
        file << at[0] + (size == 1 ? 8 : 0) << "," << at[1] << "," << at[2] << ","
             << std::pow(size, power) << "\n";
      }
    }
  };
  write("volume", 3);
  write("diameter", 1);
  const auto digest = [&](const std::string& column, std::vector<std::string> more) {
    const support::TemporaryFolder output;
    more.insert(more.begin(), {"replay", input.Path(column + ".csv"), "--surface", "--spacing", "1",
                               "--stats", output.Path("s.csv")});
    const Ran ran = RunPartiemc(more);
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    const std::string stats = Content(output.Path("s.csv"));
    EXPECT_NEAR(std::stod(Column(stats, "volume").at(0)), 1024, 10);
    return Column(stats, "surface_digest").at(0);
  };
  const std::string expected = digest("volume", {"--local", "--sizes", "own", "--check"});
  EXPECT_EQ(digest("diameter", {"--local", "--sizes", "own"}), expected);
  ServerProgram server;
  EXPECT_EQ(digest("diameter", {"--server", server.address(), "--sizes", "own"}), expected);
}

TEST(SizedReplay, VolumesDiametersAndRadiiGiveTheSame) {
  const support::TemporaryFolder input;
  const std::vector<std::string> flags = {"--local", "--sizes", "own", "--check"};
  WriteZones(input.Path("volumes.csv"), "volume", 1, 2);
  const std::string digest = DigestOf(input.Path("volumes.csv"), flags);
  WriteZones(input.Path("diameters.csv"), "diameter", 1, 1);
  EXPECT_EQ(DigestOf(input.Path("diameters.csv"), flags), digest);
  WriteZones(input.Path("radii.csv"), "radius", .5, 1);
  EXPECT_EQ(DigestOf(input.Path("radii.csv"), flags), digest);
  EXPECT_NE(DigestOf(input.Path("volumes.csv"), {"--local"}), digest);
  // A server gives the same bits.
  ServerProgram server;
  EXPECT_EQ(DigestOf(input.Path("volumes.csv"), {"--server", server.address(), "--sizes", "own"}),
            digest);
}

TEST(SizedReplay, AtWallsAServerGivesTheSame) {
  const support::TemporaryFolder input;
  WriteZones(input.Path("zones.csv"), "diameter", 1, 1);
  const auto digest = [&](std::vector<std::string> flags) {
    flags.insert(flags.end(), {"--sizes", "own", "--spacing", "1", "--check"});
    return DigestOf(input.Path("zones.csv"), flags);
  };
  const std::vector<std::string> walls = {"--wall", "0,0,1,0", "--wall", "0,1,0,0"};
  std::vector<std::string> flags = {"--local"};
  const std::string free = digest(flags);
  flags.insert(flags.end(), walls.begin(), walls.end());
  const std::string at_walls = digest(flags);
  EXPECT_NE(at_walls, free);
  ServerProgram server;
  flags = {"--server", server.address()};
  flags.insert(flags.end(), walls.begin(), walls.end());
  EXPECT_EQ(digest(flags), at_walls);
}

TEST(SizedReplay, GrainsComeFromDiametersRadiiOrAreasOfDiscs) {
  const support::TemporaryFolder input;
  std::vector<std::string> flags = {"--local", "--boundary", "grains", "--check"};
  WriteZones(input.Path("diameters.csv"), "diameter", 1, 1);
  const std::string digest = DigestOf(input.Path("diameters.csv"), flags);
  WriteZones(input.Path("radii.csv"), "radius", .5, 1);
  EXPECT_EQ(DigestOf(input.Path("radii.csv"), flags), digest);
  // Areas of discs, with more digits than floats have.
  WriteZones(input.Path("areas.csv"), "volume", std::sqrt(std::numbers::pi) / 2, 2);
  EXPECT_EQ(DigestOf(input.Path("areas.csv"), flags), digest);
  EXPECT_NE(DigestOf(input.Path("diameters.csv"), {"--local", "--sizes", "own"}), digest);
  ServerProgram server;
  EXPECT_EQ(
      DigestOf(input.Path("radii.csv"), {"--server", server.address(), "--boundary", "grains"}),
      digest);
}

// A recording has no columns, but it may have an attribute of diameters or radii.
TEST(SizedReplay, RecordingsGiveTheSameByTheirAttributes) {
  const support::TemporaryFolder input;
  WriteZones(input.Path("diameter.csv"), "diameter", 1, 1);
  WriteZones(input.Path("radius.csv"), "radius", .5, 1);
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--local", "--sizes", "own", "--spacing", "1"},
        std::vector<std::string>{"--local", "--boundary", "grains", "--spacing", "1"}}) {
    const std::string digest = DigestOf(input.Path("diameter.csv"), flags);
    for (const std::string column : {"diameter", "radius"}) {
      const std::string recording = input.Path(column + flags[2] + ".pemc");
      const Ran ran =
          RunPartiemc({"convert", input.Path(column + ".csv"), recording, "--attributes", column});
      ASSERT_EQ(ran.exit_code, 0) << ran.error;
      EXPECT_EQ(DigestOf(recording, flags), digest) << column << flags[2];
    }
  }
}

// A square packing of touching grains fills pi / 4 of a box, whichever column has their sizes.
TEST(SizedReplay, PackingOfGrainsCountsTheAreasOfDiscs) {
  const support::TemporaryFolder folder;
  for (const auto& [column, size] :
       {std::pair("diameter", 1.0), std::pair("radius", .5), std::pair("volume", .785398163)}) {
    std::ofstream file(folder.Path("grains.csv"));
    file << "x,y," << column << "\n";
    for (int k = 0; k < 400; ++k) file << k % 20 + .5 << "," << k / 20 + .5 << "," << size << "\n";
    file.close();
    const Ran ran =
        RunPartiemc({"replay", folder.Path("grains.csv"), "--local", "--boundary", "grains",
                     "--gauge", "p=packing:5,5,15,15", "--stats", folder.Path("s.csv")});
    ASSERT_EQ(ran.exit_code, 0) << ran.error;
    const auto fractions = Column(Content(folder.Path("s.csv")), "p_fraction");
    ASSERT_EQ(fractions.size(), 1u) << Content(folder.Path("s.csv"));
    EXPECT_NEAR(std::stod(fractions[0]), std::numbers::pi / 4, 1e-3) << column;
  }
}

TEST(SizedReplay, WrongSizesAreRefused) {
  const support::TemporaryFolder input;
  WriteZones(input.Path("zones.csv"), "pressure", 1, 1);
  const auto refusal = [&](const std::vector<std::string>& flags, int exit_code) {
    std::vector<std::string> all = {"replay", input.Path("zones.csv"), "--local"};
    all.insert(all.end(), flags.begin(), flags.end());
    const Ran ran = RunPartiemc(all);
    EXPECT_EQ(ran.exit_code, exit_code) << ran.error;
    return ran.error;
  };
  EXPECT_THAT(refusal({"--sizes", "own"}, 3), HasSubstr("a column volume, diameter or radius"));
  EXPECT_THAT(refusal({"--sizes", "large"}, 2), HasSubstr("equal or own"));
  EXPECT_THAT(refusal({"--boundary", "grains"}, 3),
              HasSubstr("a column volume, diameter or radius"));
  EXPECT_THAT(refusal({"--boundary", "smooth"}, 2), HasSubstr("bulk or grains"));
  EXPECT_THAT(refusal({"--sizes", "own", "--placement", "farthest-particle"}, 2),
              HasSubstr("--sizes"));
}

// A frame with a wrong size is refused if the user asked for own sizes, with the name of the column
// and the particle.
TEST(SizedReplay, AWrongSizeIsNamedByColumnAndParticle) {
  const support::TemporaryFolder input;
  ServerProgram server;
  for (const std::string column : {"volume", "diameter", "radius"}) {
    for (const std::string size : {"0", "nan", "-1", "40"}) {
      std::ofstream file(input.Path("frame.csv"));
      file << "x,y," << column << "\n";
      for (int k = 0; k < 400; ++k) {
        file << k % 20 + .5 << "," << k / 20 + .5 << "," << (k == 110 ? size : "1") << "\n";
      }
      file.close();
      const auto error = [&](std::vector<std::string> flags) {
        flags.insert(flags.begin(),
                     {"replay", input.Path("frame.csv"), "--spacing", "1", "--sizes", "own"});
        const Ran ran = RunPartiemc(flags);
        // A volume of 40 is within the limits.
        EXPECT_EQ(ran.exit_code, column == "volume" && size == "40" ? 0 : 3) << column << size;
        return ran.exit_code == 0 ? "" : ran.error;
      };
      const std::string local = error({"--local", "--quiet"});
      if (local.empty()) continue;
      EXPECT_THAT(local, HasSubstr("refused: volume of particle 110 (counted from 0) at (10.5, "
                                   "5.5), by column '" +
                                   column + "': " + (size == "40" ? "" : size + ";")));
      EXPECT_EQ(error({"--server", server.address(), "--quiet"}), local);
    }
  }
}

// Without own sizes, wrong volumes are ignored. The note is printed also with --quiet, because the
// result differs from that with right volumes.
TEST(SizedReplay, IgnoredVolumesAreReportedInQuiet) {
  const support::TemporaryFolder input;
  std::ofstream file(input.Path("frame.csv"));
  file << "x,y,volume\n";
  for (int k = 0; k < 400; ++k) {
    file << k % 20 + .5 << "," << k / 20 + .5 << "," << (k == 110 ? 0 : 1) << "\n";
  }
  file.close();
  const Ran ran =
      RunPartiemc({"replay", input.Path("frame.csv"), "--local", "--spacing", "1", "--quiet"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_THAT(ran.error, AllOf(HasSubstr("volumes are ignored: volume of particle 110 "),
                               HasSubstr("by column 'volume' is 0")));
}

TEST(SizedReplay, AWrongAttributeIsNamedByColumnAndParticle) {
  const support::TemporaryFolder input;
  std::ofstream file(input.Path("frame.csv"));
  file << "x,y,p,u\n";
  for (int k = 0; k < 400; ++k) {
    file << k % 20 + .5 << "," << k / 20 + .5 << ",1," << (k == 7 ? "inf" : "1") << "\n";
  }
  file.close();
  const Ran ran = RunPartiemc(
      {"replay", input.Path("frame.csv"), "--local", "--spacing", "1", "--attributes", "p,u"});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(ran.error,
              HasSubstr("attribute 'u' of particle 7 (counted from 0) at (7.5, 0.5): inf; must"));
}

TEST(SizedReplay, AWrongPhaseIsNamedByColumnAndParticle) {
  const support::TemporaryFolder input;
  std::ofstream file(input.Path("frame.csv"));
  file << "x,y,type\n";
  for (int k = 0; k < 400; ++k) {
    file << k % 20 + .5 << "," << k / 20 + .5 << "," << (k == 7 ? 1.5 : 1) << "\n";
  }
  file.close();
  const Ran ran = RunPartiemc(
      {"replay", input.Path("frame.csv"), "--local", "--spacing", "1", "--phases", "type=1,2"});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(ran.error, HasSubstr("attribute 'type' of particle 7 (counted from 0) at (7.5, 0.5): "
                                   "1.5; must be a whole number: a phase"));
}

// The body is the same across a face of the box as in its middle, and the same through a server.
TEST(SizedReplay, ABodyAcrossAFaceOfAPeriodicBoxIsWhole) {
  const support::TemporaryFolder input;
  WriteZones(input.Path("middle.csv"), "diameter", 1, 1);
  WriteZones(input.Path("across.csv"), "diameter", 1, 1, 10.2, 40);
  ServerProgram server;
  for (const std::string boundary : {"bulk", "grains"}) {
    const auto row = [&](const std::string& file, const std::string& box,
                         std::vector<std::string> more) {
      const support::TemporaryFolder output;
      more.insert(more.begin(),
                  {"replay", input.Path(file), "--spacing", "1", "--sizes", "own", "--boundary",
                   boundary, "--periodic", "x,y", "--box", box, "--stats", output.Path("s.csv")});
      const Ran ran = RunPartiemc(more);
      EXPECT_EQ(ran.exit_code, 0) << ran.error;
      const std::string stats = Content(output.Path("s.csv"));
      std::vector<std::string> values;
      for (const char* column : {"polylines", "area", "rings_digest"}) {
        values.push_back(Column(stats, column).at(0));
      }
      return values;
    };
    const auto middle = row("middle.csv", "-10,30,-10,30", {"--local"});
    const auto across = row("across.csv", "10.2,50.2,10.2,50.2", {"--local", "--check"});
    EXPECT_EQ(across[0], middle[0]) << boundary;
    EXPECT_NEAR(std::stod(across[1]), std::stod(middle[1]), 1e-6 * std::stod(middle[1]))
        << boundary;
    EXPECT_EQ(row("across.csv", "10.2,50.2,10.2,50.2", {"--server", server.address()}), across)
        << boundary;
  }
}

}  // namespace
}  // namespace partiemc::client
