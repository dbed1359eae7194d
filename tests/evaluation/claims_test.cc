// What of the paper reproduces, and the runs that say so.
#include "client/evaluation/paper/claims.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "client/evaluation/paper/paper.h"
#include "client/evaluation/report/report.h"
#include "client/evaluation/report/table.h"
#include "client/output/html.h"
#include "nlohmann/json.hpp"

namespace partiemc::evaluation {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

bool GoOn(std::size_t) { return true; }

// One small evaluation for all tests: a second or two.
const Evaluation& Small() {
  static const Evaluation evaluation = [] {
    StudyPlan plan;
    plan.recipes.push_back({.name = "a \"disc\" <&>", .particles = 200, .frames = 3});
    plan.methods = StudyMethods();
    const std::string_view shapes[] = {"disc"};
    Evaluation made{.set = "small", .sequences = 1};
    made.study = *RunStudy(plan, GoOn);
    made.paper = *RunPaper(DefaultFilm(), shapes, GoOn);
    made.claims = JudgeClaims(made.study, made.paper);
    return made;
  }();
  return evaluation;
}

TEST(Claims, ARatioReproducesFromNineTenthsOfTheEffectOn) {
  EXPECT_EQ(JudgeRatio(0.6, 0.5), Finding::kReproduces);
  EXPECT_EQ(JudgeRatio(0.6, 0.63), Finding::kReproduces);
  EXPECT_EQ(JudgeRatio(0.6, 0.65), Finding::kWeaker);
  EXPECT_EQ(JudgeRatio(0.6, 0.97), Finding::kWeaker);
  EXPECT_EQ(JudgeRatio(0.6, 0.99), Finding::kFails);
  EXPECT_EQ(JudgeRatio(0.6, 1.4), Finding::kFails);
  EXPECT_EQ(JudgeRatio(0.6, kAbsent), Finding::kFails);
}

TEST(Claims, OfTwoFindingsTheWorseOneCounts) {
  EXPECT_EQ(Both(Finding::kReproduces, Finding::kWeaker), Finding::kWeaker);
  EXPECT_EQ(Both(Finding::kFails, Finding::kWeaker), Finding::kFails);
  EXPECT_EQ(Both(Finding::kReproduces, Finding::kReproduces), Finding::kReproduces);
}

TEST(Claims, EveryTableAndFigureHasOne) {
  std::set<std::string> about;
  for (const Claim& claim : Small().claims) {
    about.insert(claim.about);
    EXPECT_THAT(claim.sentence, Not(HasSubstr("nan"))) << claim.about;
  }
  const std::set<std::string> wanted = {"Table 1",   "Table 2",   "Table 3",   "Table 4",
                                        "Figure 5",  "Figure 6",  "Figure 10", "Figure 11",
                                        "Figure 12", "Figure 13", "Figure 14"};
  EXPECT_EQ(about, wanted);
}

TEST(Claims, AFindingFollowsTheNumbers) {
  Evaluation changed = Small();
  for (FilmRun& run : changed.paper.film) {
    if (run.fill == Fill::kGreedy) run.triangles.assign(run.triangles.size(), 1e6);
  }
  for (const Claim& claim : JudgeClaims(changed.study, changed.paper)) {
    if (claim.about == "Figure 14" || claim.about == "Figure 12") {
      EXPECT_EQ(claim.finding, Finding::kFails) << claim.sentence;
    }
  }
}

TEST(Paper, ShowsTheFilmTheGridsAndTheThinning) {
  const PaperRuns& runs = Small().paper;
  EXPECT_EQ(runs.film_shots.size(), 4u);
  EXPECT_EQ(runs.feature_shots.size(), 3u);
  EXPECT_EQ(runs.grid_shots.size(), 4u);
  EXPECT_EQ(runs.thinned.size(), 12u);
  for (const ShareRow& row : runs.thinned) {
    EXPECT_NEAR(row.spacing_ratio, 1 / std::sqrt(row.share), 5e-3);
  }
  for (const FillRow& row : runs.fills) {
    EXPECT_TRUE(row.same_rings);
    EXPECT_LT(row.greedy, row.grid);
    EXPECT_LE(row.polygon, row.greedy);
  }
}

TEST(Paper, ReportsAsManyFramesAsItAnnounced) {
  const Sequence film = DefaultFilm();
  const std::string_view shapes[] = {"disc", "star"};
  std::size_t frames = 0;
  const auto runs = RunPaper(film, shapes, [&](std::size_t more) {
    frames += more;
    return true;
  });
  ASSERT_TRUE(runs.ok()) << runs.status();
  EXPECT_EQ(frames, PaperFrameTotal(film, shapes));
}

TEST(Report, ThePageNeedsNothingElseAndEscapesNames) {
  const std::string page = EvaluationHtml(Small());
  EXPECT_THAT(page, HasSubstr("</html>"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("http://")));
  EXPECT_THAT(page, Not(HasSubstr("https://")));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  for (const Claim& claim : Small().claims) {
    EXPECT_THAT(page, HasSubstr(client::EscapeHtml(claim.sentence)));
  }
}

TEST(Report, JsonHasEveryRowAndNullForWhatIsAbsent) {
  const auto json = nlohmann::json::parse(EvaluationJson(Small()));
  ASSERT_EQ(json["rows"].size(), Small().study.rows.size());
  EXPECT_EQ(json["rows"][0]["sequence"], "a \"disc\" <&>");
  EXPECT_EQ(json["rows"][0]["hausdorff"], Small().study.rows[0][Metric::kHausdorff]);
  EXPECT_EQ(json["claims"].size(), Small().claims.size());
  EXPECT_EQ(json["comparisons"][0]["metrics"].size(), 6u);
}

TEST(Report, CsvHasALinePerRowAndACellPerMetric) {
  const std::string csv = EvaluationCsv(Small().study);
  EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + std::ssize(Small().study.rows));
  const std::string head = csv.substr(0, csv.find('\n'));
  EXPECT_EQ(std::ranges::count(head, ','), 7 + static_cast<std::ptrdiff_t>(kMetricCount));
  EXPECT_THAT(csv, HasSubstr("\"a \"\"disc\"\" <&>\",rigid"));
}

TEST(Report, EveryFormSaysWhetherMethodsWereToldIds) {
  for (const bool told : {false, true}) {
    SCOPED_TRACE(told);
    Evaluation evaluation = Small();
    for (Row& row : evaluation.study.rows) row.ids = told;
    Row recorded = evaluation.study.rows[0];
    recorded.group = Group::kRecording;
    evaluation.study.rows.push_back(recorded);
    evaluation.notes = {"the last <note>"};
    const auto notes = NotesOf(evaluation);
    ASSERT_EQ(notes.size(), 3u);
    EXPECT_THAT(notes[0], HasSubstr(told ? "were told" : "were not told"));
    EXPECT_THAT(notes[1], HasSubstr(told ? "has ids" : "none has ids"));
    const auto json = nlohmann::json::parse(EvaluationJson(evaluation));
    EXPECT_EQ(json["notes"], notes);
    EXPECT_EQ(json["rows"][0]["ids"], told);
    const std::string text = EvaluationText(evaluation), page = EvaluationHtml(evaluation);
    for (const std::string& note : notes) {
      EXPECT_THAT(text, HasSubstr(note));
      EXPECT_THAT(page, HasSubstr(client::EscapeHtml(note)));
    }
    const auto csv = EvaluationCsv(evaluation.study);
    EXPECT_THAT(csv, HasSubstr("judged,method,knowledge,ids,"));
    EXPECT_THAT(csv,
                HasSubstr(told ? ",marching-squares,spacing,1," : ",marching-squares,spacing,0,"));
  }
}

TEST(Report, TextAndPageShowTheSameTable) {
  const Table table{"Title", "", {"one", "two"}, {{"row <1>", {{"1"}, {"2", true}}}}};
  EXPECT_EQ(AsText(table), "Title\n         one  two\nrow <1>    1   2!\n\n");
  EXPECT_THAT(AsHtml(table), HasSubstr("row &lt;1&gt;</th><td>1</td><td class=\"alert\">2</td>"));
}

}  // namespace
}  // namespace partiemc::evaluation
