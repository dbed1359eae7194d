// All methods over all sequences.
#include "client/evaluation/metrics/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "client/evaluation/report/study_tables.h"

namespace partiemc::evaluation {
namespace {

using ::testing::ElementsAre;
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
    const VirtualPlaneSteps& steps = method.method.variant.steps;
    const int off = (all.edge_vertices != steps.edge_vertices) + (all.normals != steps.normals) +
                    (all.curvature != steps.curvature) + (all.support != steps.support) +
                    (all.smoothing != steps.smoothing) + (all.area != steps.area);
    EXPECT_EQ(off, 1) << method.method.name;
    names.insert(method.method.name);
  }
  EXPECT_EQ(names.size(), 6u);
}

TEST(Study, EachSensitivityMethodHasExactlyOneConstantChanged) {
  const auto methods = SensitivityMethods();
  EXPECT_EQ(methods.size(), 2 * AllConstants().size());
  std::set<std::string> names;
  for (const StudyMethod& method : methods) {
    VirtualPlaneVariant variant = method.method.variant;
    int changed = 0;
    for (const NamedConstant& constant : AllConstants()) {
      changed += variant.constants.*constant.value != VirtualPlaneConstants{}.*constant.value;
    }
    EXPECT_EQ(changed, 1) << method.method.name;
    variant.constants = {};
    EXPECT_EQ(variant, VirtualPlaneVariant{}) << method.method.name;
    EXPECT_EQ(method.method.parameters, ReconstructionParameters{}) << method.method.name;
    names.insert(method.method.name);
  }
  EXPECT_EQ(names.size(), methods.size());
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
  // Six methods, of which one needs a spacing: left out where there is none.
  EXPECT_EQ(study->rows.size(), 3u * (6 + 5));
}

TEST(Study, ScenesTellIdsWhereThisIsAskedFor) {
  StudyPlan plan = SmallPlan();
  plan.ids = true;
  const auto study = RunAnnounced(plan);
  ASSERT_TRUE(study.ok()) << study.status();
  EXPECT_TRUE(study->ToldIds(false));
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

TEST(Study, RecordingsTellIdsWhereTheyHaveSome) {
  for (const bool some : {false, true}) {
    SCOPED_TRACE(some);
    StudyPlan plan = SmallPlan();
    plan.recipes.resize(1);
    plan.recordings = {RecordedDisc(false), RecordedDisc(some)};
    const auto study = RunAnnounced(plan);
    ASSERT_TRUE(study.ok()) << study.status();
    EXPECT_FALSE(study->ToldIds(false));
    EXPECT_EQ(study->ToldIds(true), some);
    const auto rows = study->Of("virtual-plane", Knowledge::kSpacing, true);
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_FALSE(rows[0].ids);
    EXPECT_EQ(rows[1].ids, some);
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

// Rows of the baseline and of one method: (sequence, group, sampler, mean deviation of both).
struct Made {
  std::string sequence;
  Group group;
  std::string sampler;
  double method, baseline;
};

Study StudyOf(const std::vector<Made>& made) {
  Study study;
  study.methods = StudyMethods();
  study.told = {Knowledge::kSpacing};
  for (const Made& numbers : made) {
    for (const bool baseline : {true, false}) {
      Row row;
      row.sequence = numbers.sequence;
      row.group = numbers.group;
      row.sampler = numbers.sampler;
      row.method = baseline ? std::string(kBaseline) : "virtual-plane";
      row.knowledge = Knowledge::kSpacing;
      row.values.fill(kAbsent);
      row.values[static_cast<std::size_t>(Metric::kMeanDeviation)] =
          baseline ? numbers.baseline : numbers.method;
      row.frames.resize(3);
      for (FrameNumbers& frame : row.frames) {
        frame.neighbours = {baseline ? 0.9 : 0, 0.1};
      }
      study.rows.push_back(row);
    }
  }
  return study;
}

std::vector<std::string> NamesOf(const Table& table) {
  std::vector<std::string> names;
  for (const TableRow& row : table.rows) {
    if (!row.part) names.push_back(row.name);
  }
  return names;
}

TEST(StudyTables, PutTheWorstGroupAndSamplerFirstAndListWhatIsLost) {
  const Study study = StudyOf({{"a", Group::kRigid, "lattice", 0.5, 1},
                               {"b", Group::kRigid, "clumped", 2, 1},
                               {"c", Group::kNoise, "lattice", 3, 1},
                               {"d", Group::kGrowth, "relaxed", 1.2, 1}});
  const Selection selection{Knowledge::kSpacing, false};
  const auto tables = DetailTables(study, selection, "virtual-plane");
  ASSERT_EQ(tables.size(), 3u);
  EXPECT_THAT(NamesOf(tables[0]), ElementsAre("noise", "growth", "rigid", "all"));
  EXPECT_EQ(tables[0].rows[0].cells[1].text, "3.000");
  EXPECT_TRUE(tables[0].rows[0].cells[1].alert);
  EXPECT_THAT(NamesOf(tables[1]), ElementsAre("clumped", "lattice", "relaxed", "all"));
  EXPECT_EQ(tables[1].rows[1].cells[1].text, "1.225") << "sqrt(1.5)";
  EXPECT_THAT(NamesOf(tables[2]), ElementsAre("c", "b")) << "d is below 1.25";
  EXPECT_EQ(tables[2].rows[0].cells[1].text, "3.00");
}

TEST(StudyTables, ShowSequencesWhereAllAreOfOneGroup) {
  const Study study = StudyOf({{"a", Group::kRigid, "relaxed", 0.04, 0.08},
                               {"b", Group::kRigid, "relaxed-100", 0.06, 0.03}});
  const Table table = DetailTables(study, {Knowledge::kSpacing, false}, "virtual-plane")[0];
  EXPECT_THAT(NamesOf(table), ElementsAre("b", "a", "mean (ratio: geometric)"));
  EXPECT_EQ(table.rows[0].cells[0].text, "0.0600");
  EXPECT_EQ(table.rows[0].cells[2].text, "2.000");
  EXPECT_TRUE(table.rows[0].cells[2].alert);
  EXPECT_EQ(table.rows[2].cells[0].text, "0.0500");
  EXPECT_EQ(table.rows[2].cells[1].text, "0.0550");
  EXPECT_EQ(table.rows[2].cells[2].text, "1.000");
}

TEST(StudyTables, ShowTheNearestNeighboursOfSamplersAndRecordings) {
  Study study = StudyOf({{"a", Group::kRigid, "clumped", 1, 1},
                         {"b", Group::kGrowth, "clumped", 1, 1},
                         {"c", Group::kRigid, "lattice", 1, 1},
                         {"r.pemc", Group::kRecording, "", 1, 1}});
  study.rows[0].frames[0].neighbours = {0.3, 0.7};  // One of six frames of the sampler.
  study.rows[6].frames[2].neighbours = {0.5, 0.2};
  const Table table = NeighbourTable(study);
  EXPECT_THAT(NamesOf(table), ElementsAre("clumped", "lattice", "r.pemc, first frame",
                                          "r.pemc, middle frame", "r.pemc, last frame"));
  EXPECT_EQ(table.rows[0].cells[0].text, "0.800");
  EXPECT_EQ(table.rows[0].cells[1].text, "0.200");
  EXPECT_EQ(table.rows[3].cells[0].text, "0.900");
  EXPECT_EQ(table.rows[4].cells[0].text, "0.500");
}

}  // namespace
}  // namespace partiemc::evaluation
