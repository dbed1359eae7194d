// `partiemc evaluate` as a shell would run it: the smoke set, which CI makes for its page.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "client/cli/program.h"
#include "nlohmann/json.hpp"

namespace partiemc::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

TEST(Evaluate, TheSmokeSetAndADamBreakMakePageCsvAndJson) {
  const support::TemporaryFolder directory;
  const std::string output = directory.Path("made/by/it");
  const Ran ran = RunPartiemc({"evaluate", "--set", "smoke", "--recording", kDamBreak, "--frames",
                               "0:20", "--steps", "--output-dir", output});
  ASSERT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.error, HasSubstr(" frames"));
  EXPECT_THAT(ran.out, HasSubstr("won / tied / lost"));
  EXPECT_THAT(FilesIn(output), ElementsAre("evaluation.csv", "evaluation.html", "evaluation.json"));

  const auto json = nlohmann::json::parse(Content(output + "/evaluation.json"));
  std::set<std::string> sequences, methods, on_scenes;
  for (const auto& row : json["rows"]) {
    sequences.insert(row["sequence"]);
    methods.insert(row["method"]);
    if (row["group"] != "recording") on_scenes.insert(row["method"]);
    EXPECT_EQ(row["ids"], row["group"] == "recording") << row;
    EXPECT_GT(row["vertices"], 3) << row;
    EXPECT_EQ(row["spurious_components"], 0) << row;
    if (row["method"] != "farthest-particle") {
      EXPECT_EQ(row["folds"], 0) << row;
    }
  }
  EXPECT_EQ(sequences.size(), 8u) << "one of each group, and the recording";
  EXPECT_EQ(on_scenes.size(), 12u);
  EXPECT_EQ(methods.size(), 13u) << "virtual-plane-no-memory is for the recording, which has ids";
  const std::string csv = Content(output + "/evaluation.csv");
  EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + std::ssize(json["rows"]));

  const std::string page = Content(output + "/evaluation.html");
  EXPECT_THAT(page, StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(page, HasSubstr("</html>"));
  EXPECT_THAT(page, HasSubstr("dam_break.pemc"));
  for (const char* part : {"Table 1", "Table 4", "Figure 5", "Figures 6 and 10", "Figure 11",
                           "Figure 12", "Figure 13", "Figure 14", "Fills"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  EXPECT_THAT(page, Not(HasSubstr("nan")));
}

TEST(Evaluate, ScenesTellIdsWhereTheyAreAskedTo) {
  const support::TemporaryFolder directory;
  const Ran ran = RunPartiemc({"evaluate", "--ids", "--quiet", "--methods",
                               "virtual-plane-no-memory", "--output-dir", directory.Path("out")});
  ASSERT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.out, HasSubstr("methods were told which particle is which (--ids)"));
  const auto json = nlohmann::json::parse(Content(directory.Path("out/evaluation.json")));
  std::set<std::string> methods;
  for (const auto& row : json["rows"]) {
    methods.insert(row["method"]);
    EXPECT_EQ(row["ids"], true) << row;
  }
  EXPECT_THAT(methods, ElementsAre("farthest-particle", "marching-squares", "qef", "virtual-plane",
                                   "virtual-plane-no-memory"));
}

TEST(Evaluate, AWrongWordIsOneLineAndNothingIsMade) {
  const support::TemporaryFolder directory;
  const std::vector<std::vector<std::string>> wrong = {
      {"--set", "smok"},
      {"--methods", "marching-cubes"},
      {"--threads", "0"},
      {"--recording", kDamBreak, "--frames", "x"},
      {"--recording", kDamBreak, "--select", "type=1"},
  };
  for (std::vector<std::string> arguments : wrong) {
    arguments.insert(arguments.begin(), "evaluate");
    arguments.insert(arguments.end(), {"--output-dir", directory.Path("out")});
    const Ran ran = RunPartiemc(arguments);
    EXPECT_EQ(ran.exit_code, 2) << ran.error;
    EXPECT_EQ(std::ranges::count(ran.error, '\n'), 1) << ran.error;
    EXPECT_THAT(ran.out, IsEmpty());
  }
  EXPECT_THAT(FilesIn(directory.path()), IsEmpty());
}

TEST(Evaluate, ARecordingOfOneFrameIsRefused) {
  const Ran ran = RunPartiemc({"evaluate", "--recording", kDamBreak, "--frames", "3"});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(ran.error, HasSubstr("must be two or more"));
}

}  // namespace
}  // namespace partiemc::client
