// `partiemc replay --surface` as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// Two balls of particles with the attribute `p`, in two frames that differ by a shift.
void WriteBalls(const support::TemporaryFolder& directory) {
  for (int frame = 0; frame < 2; ++frame) {
    std::ofstream file(directory.Path("frame_" + std::to_string(frame) + ".csv"));
    file << "x,y,z,p\n";
    for (const int centre : {0, 12}) {
      for (int x = -5; x <= 5; ++x) {
        for (int y = -5; y <= 5; ++y) {
          for (int z = -5; z <= 5; ++z) {
            if (x * x + y * y + z * z > 20) continue;
            file << x + centre + .3 * frame << "," << y << "," << z << "," << x << "\n";
          }
        }
      }
    }
  }
}

std::vector<std::string> Flags(const support::TemporaryFolder& input,
                               std::vector<std::string> more) {
  std::vector<std::string> flags = {"replay",    input.path().string(), "--local",
                                    "--surface", "--spacing",           "1"};
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

TEST(SurfaceReplay, WritesFilesStatisticsAndOutlinesOnPlanes) {
  const support::TemporaryFolder input, output;
  WriteBalls(input);
  const Ran ran = RunPartiemc(
      Flags(input, {"--check", "--slice", "z=0", "--attributes", "p", "--output-dir",
                    output.Path("files"), "--format", "ply,stl", "--stats", output.Path("s.csv")}));
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.out, AllOf(HasSubstr("2 frames"), HasSubstr("bodies")));
  const std::string stats = Content(output.Path("s.csv"));
  EXPECT_THAT(Column(stats, "bodies"), ElementsAre("2", "2"));
  EXPECT_THAT(Column(stats, "genus"), ElementsAre("0", "0"));
  EXPECT_THAT(Column(stats, "particles"), ElementsAre("778", "778"));
  EXPECT_THAT(FilesIn(output.path()),
              ElementsAre("files/frame_000000.ply", "files/frame_000000.stl",
                          "files/frame_000000_section_1.ply", "files/frame_000000_section_1.stl",
                          "files/frame_000001.ply", "files/frame_000001.stl",
                          "files/frame_000001_section_1.ply", "files/frame_000001_section_1.stl",
                          "s.csv", "s_sections.csv"));
  const std::string of_sections = Content(output.Path("s_sections.csv"));
  EXPECT_THAT(Column(of_sections, "frame"), ElementsAre("0", "1"));
  EXPECT_THAT(Column(of_sections, "section"), ElementsAre("1", "1"));
  EXPECT_THAT(Column(of_sections, "polylines"), ElementsAre("2", "2"));
  const std::string ply = Content(output.Path("files/frame_000001.ply"));
  EXPECT_THAT(ply, StartsWith("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_THAT(ply.substr(0, 600), HasSubstr("property float p\n"));
}

TEST(SurfaceReplay, WritesPlyByDefault) {
  const support::TemporaryFolder input, output;
  WriteBalls(input);
  const Ran ran = RunPartiemc(Flags(input, {"--frames", "0:1", "--output-dir", output.Path("")}));
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(FilesIn(output.path()), ElementsAre("frame_000000.ply"));
}

TEST(SurfaceReplay, WithoutOutputsNamesThem) {
  const support::TemporaryFolder input, output;
  WriteBalls(input);
  const Ran without = RunPartiemc(Flags(input, {"--frames", "0:1"}));
  EXPECT_EQ(without.exit_code, 0);
  EXPECT_THAT(without.error, AllOf(HasSubstr("no file was written"), HasSubstr("--output-dir")));
  const Ran with = RunPartiemc(Flags(input, {"--frames", "0:1", "--stats", output.Path("s.csv")}));
  EXPECT_THAT(with.error, Not(HasSubstr("no file was written")));
}

TEST(SurfaceReplay, WritesAReport) {
  const support::TemporaryFolder input, output;
  WriteBalls(input);
  const Ran ran = RunPartiemc(Flags(input, {"--attributes", "p", "--report", output.Path("r.html"),
                                            "--report-particles", "100"}));
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(FilesIn(output.path()), ElementsAre("r.html"));
  const std::string report = Content(output.Path("r.html"));
  EXPECT_THAT(report, HasSubstr("\"bodies\":2,\"cavities\":0,\"genus\":0"));
  EXPECT_THAT(report, HasSubstr("\"particles_shown\":100,\"particles_given\":778"));
  EXPECT_THAT(report, HasSubstr("id=\"space-part\""));
  EXPECT_LT(report.size(), 520'000u);
}

TEST(SurfaceReplay, DropsSmallBodiesOnRequest) {
  const support::TemporaryFolder input, output;
  WriteBalls(input);
  const auto size_with = [&](const std::string& least) {
    const Ran ran = RunPartiemc(
        Flags(input, {"--frames", "0:1", "--min-volume", least, "--output-dir", output.Path("")}));
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    return Content(output.Path("frame_000000.ply")).size();
  };
  EXPECT_GT(size_with("0"), 10 * size_with("1000"));
}

TEST(SurfaceReplay, PlanesBesideTheParticlesAreTold) {
  const support::TemporaryFolder input;
  WriteBalls(input);
  const auto error = [&](std::vector<std::string> flags) {
    flags.insert(flags.begin(),
                 {"replay", input.path().string(), "--local", "--quiet", "--spacing", "1"});
    const Ran ran = RunPartiemc(flags);
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    return ran.error;
  };
  EXPECT_EQ(error({"--slice", "z=7"}),
            "partiemc: --slice z=7: the plane meets no particle; along z it is at 7, and the "
            "particles are from -4 to 4\npartiemc: no frame has an outline\n");
  // A surface has its bodies nevertheless. In both frames together, x goes from -4 to 16.3.
  EXPECT_EQ(error({"--surface", "--slice", "z=0", "--slice", "x=-6"}),
            "partiemc: --slice x=-6: the plane meets no particle; along x it is at -6, and the "
            "particles are from -4 to 16.3\n");
  EXPECT_THAT(error({"--slice", "0,0,9,1,0,1"}), Not(HasSubstr("meets no particle")));
  EXPECT_THAT(error({"--slice", "0,0,-9,1,0,1"}), HasSubstr("along its normal it is at -6.364"));
}

TEST(SurfaceReplay, TellsWhatItRequires) {
  const support::TemporaryFolder input;
  WriteBalls(input);
  const std::string frames = input.path().string();
  const Ran flat = RunPartiemc({"replay", frames, "--local"});
  EXPECT_EQ(flat.exit_code, 3);
  EXPECT_THAT(flat.error, AllOf(HasSubstr("is 3D"), HasSubstr("--surface"), HasSubstr("--slice")));
  const Ran in_plane = RunPartiemc({"replay", kDamBreak, "--local", "--surface"});
  EXPECT_EQ(in_plane.exit_code, 3);
  EXPECT_THAT(in_plane.error, HasSubstr("has two coordinates; leave --slice, --surface"));
}

TEST(SurfaceReplay, EstimatesTheSpacingOfTheFirstFrame) {
  const support::TemporaryFolder input, output;
  WriteBalls(input);
  const auto digests = [&](std::vector<std::string> flags) {
    flags.insert(flags.begin(),
                 {"replay", input.path().string(), "--local", "--stats", output.Path("s.csv")});
    const Ran ran = RunPartiemc(flags);
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    const bool is_told =
        ran.error.find("spacing 1 estimated from the first frame") != std::string::npos;
    EXPECT_EQ(is_told, flags.back() != "1") << ran.error;
    const std::string statistics = Content(output.Path("s.csv"));
    return Column(statistics, statistics.find("surface_digest") != std::string::npos
                                  ? "surface_digest"
                                  : "rings_digest");
  };
  const auto given = digests({"--surface", "--spacing", "1"});
  EXPECT_FALSE(given.empty());
  EXPECT_EQ(digests({"--surface"}), given);
  EXPECT_EQ(digests({"--surface", "--spacing", "first-frame"}), given);
  EXPECT_EQ(digests({"--slice", "z=0"}), digests({"--slice", "z=0", "--spacing", "1"}));

  const support::TemporaryFolder one;
  std::ofstream(one.Path("a.csv")) << "x,y,z\n1,2,3\n";
  const Ran without = RunPartiemc({"replay", one.path().string(), "--local", "--surface"});
  EXPECT_EQ(without.exit_code, 3);
  EXPECT_THAT(without.error, HasSubstr("--spacing: absent; must be given, because no frame has"));
}

TEST(SurfaceReplay, TheBundledDropsKeepTheVolumeOfTheirParticles) {
  const support::TemporaryFolder output;
  const Ran ran =
      RunPartiemc({"replay", PARTIEMC_SOURCE_DIR "/client/recordings/colliding_drops.pemc",
                   "--local", "--surface", "--check", "--stats", output.Path("s.csv")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  const std::vector<std::string> volumes = Column(Content(output.Path("s.csv")), "volume");
  EXPECT_EQ(volumes.size(), 50u);
  for (const std::string& volume : volumes) EXPECT_NEAR(std::stod(volume), 3.582, .01);
}

// The surfaces that a server made are those of this process, for the producer and for a watcher.
TEST(SurfaceReplay, IsTheSameThroughAServer) {
  const support::TemporaryFolder input, output;
  WriteBalls(input);
  const ServerProgram server;
  const auto files = [&](const std::string& name) -> std::vector<std::string> {
    return {"--output-dir", output.Path(name), "--format",
            "ply,vtp,obj",  "--stats",         output.Path(name + ".csv")};
  };
  const auto with = [](std::vector<std::string> flags, const std::vector<std::string>& more) {
    flags.insert(flags.end(), more.begin(), more.end());
    return flags;
  };
  const std::vector<std::string> what = {
      "--surface", "--spacing", "1", "--slice", "z=0", "--attributes", "p", "--simplify", ".05"};
  const std::string frames = input.path().string();
  const Ran local = RunPartiemc(with({"replay", frames, "--local"}, with(what, files("local"))));
  ASSERT_EQ(local.exit_code, 0) << local.error;

  Program watch(PARTIEMC_PROGRAM, with({"watch", "balls", "--server", server.address(), "--wait",
                                        "--from", "oldest", "--record", output.Path("balls.pemc")},
                                       files("watched")));
  const Ran served = RunPartiemc(with({"replay", frames, "--server", server.address(), "--name",
                                       "balls", "--rate", "1", "--echo-particles", "--check"},
                                      with(what, files("served"))));
  ASSERT_EQ(served.exit_code, 0) << served.error;
  ASSERT_EQ(watch.Wait(), 0) << watch.Error();
  EXPECT_THAT(watch.Out(), AllOf(HasSubstr("triangles"), HasSubstr("--surface --simplify 0.05")));

  // Attributes are not recorded, but the recording gives the outlines and surfaces of the stream.
  const Ran again = RunPartiemc(with({"replay", output.Path("balls.pemc"), "--local"},
                                     {"--surface", "--simplify", "0.05", "--slice", "0,0,0,0,0,1",
                                      "--stats", output.Path("again.csv")}));
  ASSERT_EQ(again.exit_code, 0) << again.error;
  const auto digests = [&](const std::string& name) {
    return Column(Content(output.Path(name + ".csv")), "surface_digest");
  };
  EXPECT_EQ(digests("local").size(), 2u);
  for (const std::string name : {"served", "watched", "again"}) {
    EXPECT_EQ(digests(name), digests("local")) << name;
  }
  for (const std::string name : {"served", "watched"}) {
    const auto made = FilesIn(output.Path("local"));
    EXPECT_EQ(FilesIn(output.Path(name)), made);
    for (const std::string& file : made) {
      EXPECT_EQ(Content(output.Path(name + "/" + file)), Content(output.Path("local/" + file)))
          << name << "/" << file;
    }
  }
}

TEST(SurfaceReplay, CompactCoordinatesAreNearThoseOfThisProcess) {
  const support::TemporaryFolder input, output;
  WriteBalls(input);
  const ServerProgram server;
  const auto triangles = [&](const std::string& name, std::vector<std::string> flags) {
    flags.insert(flags.begin(), {"replay", input.path().string(), "--surface", "--spacing", "1",
                                 "--output-dir", output.Path(name), "--format", "stl"});
    const Ran ran = RunPartiemc(flags);
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    return Content(output.Path(name + "/frame_000001.stl")).size();
  };
  const std::size_t exact = triangles("exact", {"--server", server.address()});
  EXPECT_EQ(triangles("compact", {"--server", server.address(), "--coordinates", "compact"}),
            exact);
  EXPECT_NE(Content(output.Path("exact/frame_000001.stl")),
            Content(output.Path("compact/frame_000001.stl")));
  const Ran checked = RunPartiemc({"replay", input.path().string(), "--check", "--coordinates",
                                   "compact", "--surface", "--spacing", "1"});
  EXPECT_EQ(checked.exit_code, 2);
  EXPECT_THAT(checked.error, HasSubstr("--check: requires --coordinates float64"));
}

}  // namespace
}  // namespace partiemc::client
