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
  std::set<std::string> sequences, methods;
  for (const auto& row : json["rows"]) {
    sequences.insert(row["sequence"]);
    methods.insert(row["method"]);
    EXPECT_EQ(row["ids"], row["group"] == "recording") << row;
    EXPECT_GT(row["vertices"], 3) << row;
    EXPECT_EQ(row["spurious_components"], 0) << row;
    if (row["method"] != "farthest-particle") {
      EXPECT_EQ(row["folds"], 0) << row;
    }
  }
  EXPECT_EQ(sequences.size(), 8u) << "one of each group, and the recording";
  EXPECT_EQ(methods.size(), 12u);
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
                               "virtual-plane-no-volumes", "--output-dir", directory.Path("out")});
  ASSERT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.out, HasSubstr("methods were told which particle is which (--ids)"));
  const auto json = nlohmann::json::parse(Content(directory.Path("out/evaluation.json")));
  std::set<std::string> methods;
  for (const auto& row : json["rows"]) {
    methods.insert(row["method"]);
    EXPECT_EQ(row["ids"], true) << row;
  }
  EXPECT_THAT(methods, ElementsAre("farthest-particle", "marching-squares", "qef", "virtual-plane",
                                   "virtual-plane-no-volumes"));
}

TEST(Evaluate, RecordingsOfAFolderAreMeasuredByWhatIsKnownOfThem) {
  const support::TemporaryFolder directory;
  const Ran ran = RunPartiemc({"evaluate", "--quiet", "--methods", "virtual-plane", "--recordings",
                               PARTIEMC_SOURCE_DIR "/tests/data/recordings", "--frames", "8:11",
                               "--output-dir", directory.Path("out")});
  ASSERT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.out, HasSubstr("ratios by sequence, spacing given, virtual-plane"));
  EXPECT_THAT(ran.out, HasSubstr("ellipse.pemc, middle frame"));
  const auto json = nlohmann::json::parse(Content(directory.Path("out/evaluation.json")));
  std::set<std::string> all, with_walls, with_truth, with_area;
  for (const auto& row : json["rows"]) {
    if (row["group"] != "recording") continue;
    all.insert(row["sequence"]);
    EXPECT_TRUE(row["known_mean_jitter"].is_number()) << row;
    if (row["wall_roughness"].is_number()) with_walls.insert(row["sequence"]);
    if (row["mean_deviation"].is_number()) with_truth.insert(row["sequence"]);
    if (row["area_error_size"].is_number()) with_area.insert(row["sequence"]);
  }
  EXPECT_THAT(all, ElementsAre("drop_on_film.pemc", "ellipse.pemc", "granular_column.pemc",
                               "sloshing.pemc", "splash.pemc", "square.pemc"));
  EXPECT_THAT(with_walls, ElementsAre("drop_on_film.pemc", "granular_column.pemc", "sloshing.pemc",
                                      "splash.pemc"));
  EXPECT_THAT(with_truth, ElementsAre("ellipse.pemc"));
  EXPECT_THAT(with_area, ElementsAre("ellipse.pemc", "sloshing.pemc", "square.pemc"));
}

TEST(Evaluate, AWrongWordIsOneLineAndNothingIsMade) {
  const support::TemporaryFolder directory;
  const std::vector<std::vector<std::string>> wrong = {
      {"--set", "smok"},
      {"--methods", "marching-cubes"},
      {"--threads", "0"},
      {"--recording", kDamBreak, "--frames", "x"},
      {"--recording", kDamBreak, "--select", "type=1"},
      {"--recordings"},
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

TEST(Evaluate, AFolderWithoutRecordingsIsRefused) {
  const support::TemporaryFolder directory;
  for (const std::string& folder : {directory.path().string(), directory.Path("absent")}) {
    const Ran ran = RunPartiemc({"evaluate", "--recordings", folder});
    EXPECT_EQ(ran.exit_code, 3) << ran.error;
    EXPECT_THAT(ran.error, HasSubstr(folder));
  }
}

TEST(Evaluate, ARecordingOfOneFrameIsRefused) {
  const Ran ran = RunPartiemc({"evaluate", "--recording", kDamBreak, "--frames", "3"});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(ran.error, HasSubstr("must be two or more"));
}

}  // namespace
}  // namespace partiemc::client
