// Invalid command lines: one line, exit code 2, no effect.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

void ExpectOneLine(const Ran& ran) {
  EXPECT_THAT(ran.error, StartsWith("partiemc: "));
  EXPECT_EQ(std::ranges::count(ran.error, '\n'), 1) << ran.error;
  EXPECT_TRUE(ran.error.ends_with('\n'));
  EXPECT_THAT(ran.out, IsEmpty());
}

TEST(Usage, HelpTeachesEveryVerbByExamples) {
  const Ran help = RunPartiemc({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* verb : {"replay", "watch", "streams", "info", "load", "convert"}) {
    EXPECT_THAT(help.out, HasSubstr(verb));
    const Ran verb_help = RunPartiemc({verb, "--help"});
    EXPECT_EQ(verb_help.exit_code, 0);
    EXPECT_THAT(verb_help.out, HasSubstr("Examples:"));
  }
}

TEST(Usage, VersionIsOneLine) {
  const Ran ran = RunPartiemc({"--version"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_THAT(ran.out, StartsWith("partiemc "));
}

TEST(Usage, UnknownFlagsAreNamedInTheirOrder) {
  const Ran other = RunPartiemc({"replay", kDamBreak, "--fil", "grid"});
  EXPECT_EQ(other.error, "partiemc: --fil grid: not expected; see `partiemc replay --help`\n");
  const Ran of_splashsurf = RunPartiemc({"replay", kDamBreak, "--surface", "-r", "0.025"});
  EXPECT_EQ(of_splashsurf.error,
            "partiemc: -r 0.025: not expected; core/SURFACES.md has the counterparts of "
            "splashsurf's flags; see `partiemc replay --help`\n");
}

TEST(Usage, AWrongWordIsOneLineAndExitCodeTwo) {
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"repaly"},
      {"replay"},
      {"replay", kDamBreak, "--fil", "grid"},
      {"replay", kDamBreak, "--local", "--placement", "squares"},
      {"replay", kDamBreak, "--local", "--fill", "greed"},
      {"replay", kDamBreak, "--local", "--spacing", "-1"},
      {"replay", kDamBreak, "--local", "--spacing", "first"},
      {"replay", kDamBreak, "--local", "--kernel-radius", "99"},
      {"replay", kDamBreak, "--local", "--kernel-radius", "wide"},
      {"replay", kDamBreak, "--local", "--clean", "maybe"},
      {"replay", kDamBreak, "--local", "--min-area", "-1"},
      {"replay", kDamBreak, "--local", "--min-area", "inf"},
      {"replay", kDamBreak, "--local", "--surface", "--min-area", "3"},
      {"replay", kDamBreak, "--local", "--surface", "--fill", "grid"},
      {"replay", kDamBreak, "--local", "--boundary", "grains", "--sizes", "equal"},
      {"replay", kDamBreak, "--local", "--min-particles", "-1"},
      {"replay", kDamBreak, "--local", "--slice", "w=1"},
      {"replay", kDamBreak, "--local", "--slice", "z="},
      {"replay", kDamBreak, "--local", "--slice", "0,0,0,0,1"},
      {"replay", kDamBreak, "--local", "--slice", "0,0,0,0,0,1,"},
      {"replay", kDamBreak, "--local", "--slice", "0,0,0,0,0,0"},
      {"replay", kDamBreak, "--local", "--slice", "z=0", "--spacing", "every-frame"},
      {"replay", kDamBreak, "--check", "--coordinates", "compact"},
      {"replay", kDamBreak, "--coordinates", "small"},
      {"replay", kDamBreak, "--local", "--coordinates", "compact"},
      {"replay", kDamBreak, "--local", "--surface", "--spacing", "every-frame"},
      {"replay", kDamBreak, "--local", "--surface", "--placement", "farthest-particle"},
      {"replay", kDamBreak, "--local", "--surface", "--isolines", ".4"},
      {"replay", kDamBreak, "--local", "--surface", "--thinning-distance", "-1"},
      {"replay", kDamBreak, "--local", "--surface", "--min-volume", "inf"},
      {"replay", kDamBreak, "--local", "--min-volume", "8"},
      {"replay", kDamBreak, "--local", "--surface", "--simplify", "1.1"},
      {"replay", kDamBreak, "--local", "--surface", "--report", "report.html", "--color-by", "p"},
      {"replay", kDamBreak, "--local", "--report-particles", "100"},
      {"replay", kDamBreak, "--local", "--report", "report.html", "--report-particles", "-1"},
      {"replay", kDamBreak, "--local", "--surface", "--output-dir", "out", "--format", "geojson"},
      {"replay", kDamBreak, "--local", "--rate", "0"},
      {"replay", kDamBreak, "--local", "--threads", "0"},
      {"replay", kDamBreak, "--threads", "2"},
      {"replay", kDamBreak, "--local", "--loop", "--stats", "loop.csv"},
      {"replay", kDamBreak, "--local", "--server", "127.0.0.1:1"},
      {"replay", kDamBreak, "--local", "--format", "svg"},
      {"replay", kDamBreak, "--local", "--compress-glb"},
      {"replay", kDamBreak, "--local", "--output-dir", "out", "--format", "svg", "--compress-glb"},
      {"replay", kDamBreak, "--local", "--frames", "x"},
      {"replay", kDamBreak, "--local", "--select", "type=1"},
      {"replay", kDamBreak, "--local", "--stats", "stats.xls"},
      {"replay", kDamBreak, "--local", "--gauge", "front=front:1,0"},
      {"replay", kDamBreak, "--local", "--stats", "stats.csv", "--gauge", "front=front:0,0"},
      {"replay", kDamBreak, "--local", "--stats", "stats.csv", "--gauge", "area=wetted:0,0,1,1"},
      {"replay", kDamBreak, "--server", "nowhere"},
      {"replay", kDamBreak, "--local", "--name", "dam"},
      {"watch"},
      {"watch", "dam", "--server", "nowhere"},
      {"watch", "dam", "--mode", "some"},
      {"watch", "dam", "--frames", "0"},
      {"watch", "dam", "--from", "0"},
      {"watch", "dam", "--from", "newest"},
      {"watch", "dam", "--from", "7x"},
      {"watch", "dam", "--record", "dam.csv"},
      {"watch", "dam", "--record", "dam.pemc", "--mode", "latest"},
      {"watch", "dam", "--format", "svg"},
      {"watch", "dam", "--output-dir", "out", "--format", "png"},
      {"watch", "dam", "--stats", "stats.xls"},
      {"streams", "--server", "nowhere"},
      {"info", "--server", "nowhere"},
      {"convert", kDamBreak},
      {"convert", kDamBreak, "out.csv"},
      {"convert", kDamBreak, "out.pemc", "--spacing", "0"},
      {"convert", kDamBreak, "out.pemc", "--compression-level", "40"},
  };
  for (const auto& arguments : wrong) {
    SCOPED_TRACE(::testing::PrintToString(arguments));
    const Ran ran = RunPartiemc(arguments);
    EXPECT_EQ(ran.exit_code, 2);
    ExpectOneLine(ran);
  }
}

TEST(Usage, AWrongVerbIsAnsweredWithTheVerbs) {
  EXPECT_THAT(RunPartiemc({"reconstruct", kDamBreak}).error,
              AllOf(HasSubstr("'reconstruct'"), HasSubstr("replay, watch"), HasSubstr("convert"),
                    HasSubstr("see `partiemc --help`")));
}

TEST(Usage, AWrongFlagPointsToTheHelpOfItsVerb) {
  EXPECT_THAT(RunPartiemc({"replay", kDamBreak, "--fil", "grid"}).error,
              HasSubstr("see `partiemc replay --help`"));
}

TEST(Usage, SelectTakesOneWordSoThatTheInputMayFollow) {
  const Ran ran = RunPartiemc({"replay", "--select", "type=1", "/nonexistent", "--local"});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(ran.error, HasSubstr("/nonexistent"));
}

TEST(Usage, NoServerThereIsExitCodeFour) {
  for (const auto& arguments : std::vector<std::vector<std::string>>{
           {"replay", kDamBreak, "--server", "unix:/nonexistent/socket"},
           {"info", "--server", "unix:/nonexistent/socket"},
           {"streams", "--server", "unix:/nonexistent/socket"},
           {"watch", "dam", "--server", "unix:/nonexistent/socket"}}) {
    const Ran ran = RunPartiemc(arguments);
    EXPECT_EQ(ran.exit_code, 4);
    ExpectOneLine(ran);
    EXPECT_THAT(ran.error, HasSubstr("no server at unix:/nonexistent/socket"));
    EXPECT_THAT(ran.error, HasSubstr("start one with `partiemc-server --address"));
    // The only verb that works without.
    EXPECT_EQ(ran.error.find("--local") != std::string::npos, arguments.front() == "replay");
  }
}

}  // namespace
}  // namespace partiemc::client
