// All methods over all sequences.
#include "evaluation/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace partiemc::evaluation {
namespace {

using ::testing::HasSubstr;

bool GoOn(std::size_t) { return true; }

StudyPlan SmallPlan() {
  StudyPlan plan;
  for (const char* shape : {"disc", "star", "bar"}) {
    plan.recipes.push_back({.name = shape, .shape = shape, .particles = 200, .frames = 3});
  }
  plan.methods = StudyMethods();
  return plan;
}

// Runs a study that has to report as many frames as it announced.
absl::StatusOr<Study> RunAnnounced(const StudyPlan& plan) {
  std::size_t frames = 0;
  auto study = RunStudy(plan, [&](std::size_t more) {
    frames += more;
    return true;
  });
  EXPECT_EQ(frames, FrameTotal(plan));
  return study;
}

TEST(Study, HasTheBaselineFirstAndEveryPlacement) {
  const auto methods = StudyMethods();
  EXPECT_EQ(methods.front().method.name, kBaseline);
  std::set<Placement> placements;
  std::set<std::string> names;
  for (const StudyMethod& method : methods) {
    placements.insert(method.method.parameters.placement);
    names.insert(method.method.name);
    EXPECT_TRUE(Validate(method.method.parameters).ok()) << method.method.name;
  }
  EXPECT_EQ(placements.size(), AllPlacements().size());
  EXPECT_EQ(names.size(), methods.size());
}

TEST(Study, EachStepMethodHasExactlyOneStepOff) {
  const VirtualPlaneSteps all;
  std::set<std::string> names;
  for (const StudyMethod& method : StepMethods()) {
    const VirtualPlaneSteps& steps = method.method.parameters.steps;
    const int off = (all.edge_vertices != steps.edge_vertices) + (all.normals != steps.normals) +
                    (all.curvature != steps.curvature) + (all.support != steps.support) +
                    (all.smoothing != steps.smoothing) + (all.area != steps.area);
    EXPECT_EQ(off, 1) << method.method.name;
    names.insert(method.method.name);
  }
  EXPECT_EQ(names.size(), 6u);
}

TEST(Study, RowsAreTheSameForOneAndThreeThreads) {
  StudyPlan plan = SmallPlan();
  const auto one = RunStudy(plan, GoOn);
  plan.threads = 3;
  const auto three = RunStudy(plan, GoOn);
  ASSERT_TRUE(one.ok() && three.ok());
  ASSERT_EQ(one->rows.size(), three->rows.size());
  for (std::size_t k = 0; k < one->rows.size(); ++k) {
    const Row& a = one->rows[k];
    const Row& b = three->rows[k];
    EXPECT_EQ(a.sequence, b.sequence);
    EXPECT_EQ(a.method, b.method);
    EXPECT_EQ(a.knowledge, b.knowledge);
    for (const Metric metric : {Metric::kHausdorff, Metric::kMeanJitter, Metric::kCenterMean}) {
      EXPECT_EQ(a[metric], b[metric]) << a.sequence << ' ' << a.method << ' ' << Name(metric);
    }
  }
}

TEST(Study, ReportsAsManyFramesAsItAnnounced) {
  const StudyPlan plan = SmallPlan();
  const auto study = RunAnnounced(plan);
  ASSERT_TRUE(study.ok());
  // Seven methods, of which one needs ids, and one a spacing: left out where there is none.
  EXPECT_EQ(study->rows.size(), 3u * (6 + 5));
}

TEST(Study, TheMethodWithoutMemoryIsTheDefaultWithoutItAndNothingElse) {
  ReconstructionParameters without;
  without.outline_memory = false;
  const auto methods = StudyMethods();
  const auto found = std::ranges::find(methods, "virtual-plane-no-memory",
                                       [](const StudyMethod& m) { return m.method.name; });
  ASSERT_NE(found, methods.end());
  EXPECT_EQ(found->method.parameters, without);
  EXPECT_TRUE(found->needs_ids);
}

TEST(Study, ScenesThatTellIdsShowWhatTheMemoryIsWorth) {
  StudyPlan plan = SmallPlan();
  plan.ids = true;
  const auto study = RunAnnounced(plan);
  ASSERT_TRUE(study.ok()) << study.status();
  EXPECT_EQ(study->rows.size(), 3u * (7 + 6));
  EXPECT_TRUE(study->ToldIds(false));
  for (const Knowledge knowledge : plan.told) {
    EXPECT_EQ(study->Of("virtual-plane-no-memory", knowledge, false).size(), 3u);
  }
}

// A disc in a recording of its own, with ids or without.
Sequence RecordedDisc(bool ids) {
  Sequence recording =
      MakeScene({.name = ids ? "known" : "unknown", .particles = 200, .frames = 3});
  recording.group = Group::kRecording;
  recording.motion = nullptr;
  for (SequenceFrame& frame : recording.frames) {
    frame.truth = {};
    if (!ids) frame.ids.clear();
  }
  return recording;
}

TEST(Study, RecordingsHaveTheMethodWithoutMemoryWhereSomeHaveIds) {
  for (const bool some : {false, true}) {
    SCOPED_TRACE(some);
    StudyPlan plan = SmallPlan();
    plan.recipes.resize(1);
    plan.recordings = {RecordedDisc(false), RecordedDisc(some)};
    const auto study = RunAnnounced(plan);
    ASSERT_TRUE(study.ok()) << study.status();
    EXPECT_FALSE(study->ToldIds(false));
    EXPECT_EQ(study->ToldIds(true), some);
    const auto rows = [&](bool recordings) {
      return study->Of("virtual-plane-no-memory", Knowledge::kSpacing, recordings);
    };
    EXPECT_TRUE(rows(false).empty());
    // Both or none, so that means are over the same recordings as those of other methods.
    ASSERT_EQ(rows(true).size(), some ? 2u : 0u);
    if (!some) continue;
    EXPECT_FALSE(rows(true)[0].ids);
    EXPECT_TRUE(rows(true)[1].ids);
  }
}

TEST(Study, EndsWhereItIsToldTo) {
  std::size_t calls = 0;
  const auto study = RunStudy(SmallPlan(), [&](std::size_t) { return ++calls < 2; });
  EXPECT_EQ(study.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(calls, 2u);
}

TEST(Study, AnErrorNamesTheSequence) {
  StudyPlan plan = SmallPlan();
  plan.recipes.clear();
  Sequence recording{.name = "broken.pemc", .group = Group::kRecording};
  recording.frames.resize(2);
  recording.frames[1].positions = {0, std::nan("")};
  plan.recordings.push_back(recording);
  const auto study = RunStudy(plan, GoOn);
  EXPECT_EQ(study.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(study.status().message()), HasSubstr("broken.pemc, frame 1"));
}

TEST(Study, MeansLeaveOutWhatIsAbsentOrNotJudged) {
  std::vector<Row> rows(3);
  for (Row& row : rows) row.values.fill(kAbsent);
  const auto at = static_cast<std::size_t>(Metric::kHausdorff);
  rows[0].values[at] = 1;
  rows[1].values[at] = 7;
  rows[1].judged = false;
  EXPECT_EQ(MeanOver(rows, Metric::kHausdorff), 1);
  EXPECT_TRUE(std::isnan(MeanOver(rows, Metric::kBias)));
}

}  // namespace
}  // namespace partiemc::evaluation
