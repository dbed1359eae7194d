// Methods over sequences, in process.
#include "client/evaluation/metrics/run.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/evaluation/scenes/random.h"
#include "client/evaluation/scenes/scenes.h"

namespace partiemc::evaluation {
namespace {

Method MethodOf(Placement placement) {
  Method method;
  method.name = Name(placement);
  method.parameters.placement = placement;
  return method;
}

SceneRecipe LatticeSquare() {
  SceneRecipe recipe;
  recipe.name = "square";
  recipe.shape = "square";
  recipe.sampling = Sampling::kLattice;
  recipe.particles = 625;
  recipe.seed = 12;
  return recipe;
}

TEST(Run, FindsMarchingSquaresNearTheTruth) {
  const Evaluator evaluator(MakeScene(LatticeSquare()), true);
  const auto row = evaluator.Run(MethodOf(Placement::kMarchingSquares), {});
  ASSERT_TRUE(row.ok()) << row.status();
  EXPECT_LT((*row)[Metric::kMeanDeviation], 0.15);
  EXPECT_LT((*row)[Metric::kHausdorff], 1.2);
  EXPECT_LT((*row)[Metric::kBias], 0.03);
  EXPECT_EQ((*row)[Metric::kComponentError], 0);
  EXPECT_EQ((*row)[Metric::kSelfIntersections], 0);
  EXPECT_EQ((*row)[Metric::kFolds], 0);
  // The centres lie half a spacing inside.
  EXPECT_NEAR((*row)[Metric::kCenterMean], 0.5, 0.1);
  EXPECT_EQ(row->frames.size(), 8u);
  EXPECT_TRUE(std::isnan(row->frames[0].jitter.mean));
  EXPECT_FALSE(std::isnan(row->frames[1].jitter.mean));
}

TEST(Run, GivesTheSameNumbersAgain) {
  const Evaluator evaluator(MakeScene(LatticeSquare()));
  const Method method = MethodOf(Placement::kVirtualPlane);
  const auto once = evaluator.Run(method, {});
  const auto again = evaluator.Run(method, {});
  ASSERT_TRUE(once.ok() && again.ok());
  for (const Metric metric : {Metric::kHausdorff, Metric::kMeanDeviation, Metric::kMeanJitter,
                              Metric::kAreaError, Metric::kTriangles}) {
    EXPECT_EQ((*once)[metric], (*again)[metric]) << Name(metric);
  }
}

TEST(Run, MetricsDoNotDependOnTheUnitOfLength) {
  Sequence small = MakeScene(LatticeSquare());
  small.motion = nullptr;
  Sequence large = small;
  constexpr double kFactor = 64;  // A power of two, so that nothing is rounded differently.
  large.spacing *= kFactor;
  large.original_spacing *= kFactor;
  for (SequenceFrame& frame : large.frames) {
    for (double& x : frame.positions) x *= kFactor;
    for (float& v : frame.volumes) v *= static_cast<float>(kFactor * kFactor);
    for (Point& p : frame.truth.points) p = kFactor * p;
    frame.area *= kFactor * kFactor;
  }
  const Method method = MethodOf(Placement::kMarchingSquares);
  const auto a = Evaluator(small).Run(method, {Knowledge::kVolumes});
  const auto b = Evaluator(large).Run(method, {Knowledge::kVolumes});
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_NEAR((*a)[Metric::kHausdorff], (*b)[Metric::kHausdorff], 1e-9);
  EXPECT_NEAR((*a)[Metric::kMeanDeviation], (*b)[Metric::kMeanDeviation], 1e-9);
  EXPECT_NEAR((*a)[Metric::kAreaError], (*b)[Metric::kAreaError], 1e-9);
}

TEST(Run, RecordingsHaveJitterByVelocitiesAndAreaByVolumes) {
  Sequence recording = MakeScene(LatticeSquare());
  recording.motion = nullptr;
  recording.group = Group::kRecording;
  for (std::size_t t = 0; t < recording.frames.size(); ++t) {
    SequenceFrame& frame = recording.frames[t];
    frame.truth = {};
    frame.area = 0;
    frame.ids.clear();
    if (t + 1 == recording.frames.size()) break;
    const auto& next = recording.frames[t + 1].positions;
    for (std::size_t k = 0; k < next.size(); ++k) {
      frame.velocities.push_back(next[k] - frame.positions[k]);
    }
  }
  const auto row = Evaluator(recording).Run(MethodOf(Placement::kMarchingSquares), {});
  ASSERT_TRUE(row.ok()) << row.status();
  EXPECT_TRUE(std::isnan((*row)[Metric::kHausdorff]));
  EXPECT_LT((*row)[Metric::kMeanJitter], 0.1);
  EXPECT_LT(std::abs((*row)[Metric::kAreaError]), 0.03);
  // The last frame has no velocities to lead back.
  EXPECT_TRUE(std::isnan(row->frames.back().known_jitter.deviation.mean));
  EXPECT_EQ(row->frames.back().known_jitter.known_share, 0);
}

// A square moves as one, and beside it a cloud is drawn anew in every frame: how much of the motion
// is known hangs on the particles, and what is measured there is the square's.
TEST(Run, KnowsTheMotionOfRecordingsWhateverTheMethod) {
  Sequence recording;
  recording.name = "square and cloud";
  recording.group = Group::kRecording;
  Random random(5);
  for (std::size_t t = 0; t < 4; ++t) {
    SequenceFrame& frame = recording.frames.emplace_back();
    for (std::size_t k = 0; k < 400; ++k) {
      const Point square{0.3 * static_cast<double>(t) + static_cast<double>(k % 20),
                         static_cast<double>(k / 20)};
      const Point cloud{random.Uniform(40, 60), random.Uniform(0, 20)};
      for (const Point& p : {square, cloud}) {
        frame.ids.push_back(frame.ids.size() + 1);
        frame.positions.insert(frame.positions.end(), {p.x, p.y});
      }
    }
  }
  const Evaluator evaluator(recording);
  for (const Placement placement :
       {Placement::kMarchingSquares, Placement::kQef, Placement::kVirtualPlane}) {
    const auto row = evaluator.Run(MethodOf(placement), {});
    ASSERT_TRUE(row.ok()) << row.status();
    SCOPED_TRACE(Name(placement));
    EXPECT_GT((*row)[Metric::kMeanJitter], 0.2);
    EXPECT_LT((*row)[Metric::kKnownMeanJitter], 0.1);
    EXPECT_GT((*row)[Metric::kKnownShare], 0.4);
    EXPECT_LT((*row)[Metric::kKnownShare], 0.55);
  }
}

// The core refuses a frame with a repeated id, but only one that it is told.
Sequence WithARepeatedId() {
  Sequence sequence = MakeScene(LatticeSquare());
  sequence.frames[1].ids[7] = sequence.frames[1].ids[3];
  return sequence;
}

TEST(Run, ScenesTellTheirIdsOnRequestOnly) {
  const Method method = MethodOf(Placement::kMarchingSquares);
  const Evaluator evaluator(WithARepeatedId());
  const auto untold = evaluator.Run(method, {});
  ASSERT_TRUE(untold.ok()) << untold.status();
  EXPECT_FALSE(untold->ids);
  const auto told = evaluator.Run(method, {.ids = true});
  EXPECT_NE(told.status().message().find("square, frame 1, marching-squares: ids"),
            std::string::npos)
      << told.status();
}

TEST(Run, RecordingsAlwaysTellTheirIds) {
  Sequence recording = WithARepeatedId();
  recording.group = Group::kRecording;
  const Method method = MethodOf(Placement::kMarchingSquares);
  EXPECT_FALSE(Evaluator(recording).Run(method, {}).ok());
  for (SequenceFrame& frame : recording.frames) frame.ids.clear();
  const auto without = Evaluator(recording).Run(method, {.ids = true});
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_FALSE(without->ids);
}

TEST(Run, JitterOfScenesIsThatOfTheTrueMotionWhoeverKnowsIds) {
  Sequence scene = MakeScene(LatticeSquare());
  const Method method = MethodOf(Placement::kMarchingSquares);
  const Evaluator evaluator(scene);
  for (SequenceFrame& frame : scene.frames) frame.ids.clear();
  const auto untold = Evaluator(scene).Run(method, {});
  const auto told = evaluator.Run(method, {.ids = true});
  ASSERT_TRUE(untold.ok() && told.ok());
  EXPECT_FALSE(untold->ids);
  EXPECT_TRUE(told->ids);
  // Ids change no outline of marching squares, and nothing that is measured of one.
  for (const Metric metric : {Metric::kHausdorff, Metric::kMeanDeviation, Metric::kHausdorffJitter,
                              Metric::kMeanJitter}) {
    EXPECT_EQ((*untold)[metric], (*told)[metric]) << Name(metric);
  }
  EXPECT_TRUE(std::isnan((*told)[Metric::kKnownMeanJitter]));
}

void ExpectTheSameNumbers(const Row& a, const Row& b) {
  for (std::size_t k = 0; k < kMetricCount; ++k) {
    const auto metric = static_cast<Metric>(k);
    if (metric == Metric::kMilliseconds || std::isnan(a[metric])) continue;
    EXPECT_EQ(a[metric], b[metric]) << Name(metric);
  }
}

TEST(Run, IdsChangeNoOutline) {
  const Evaluator evaluator(
      MakeScene({.name = "star", .shape = "star", .seed = 4, .particles = 400}));
  const Method method = MethodOf(Placement::kVirtualPlane);
  const auto told = evaluator.Run(method, {.ids = true});
  const auto untold = evaluator.Run(method, {});
  ASSERT_TRUE(told.ok() && untold.ok());
  ExpectTheSameNumbers(*told, *untold);
}

TEST(Run, SaysWhichSequenceAndFrameWasRefused) {
  Sequence broken = MakeScene(LatticeSquare());
  broken.frames[2].positions[5] = std::nan("");
  const auto row = Evaluator(broken).Run(MethodOf(Placement::kMarchingSquares), {});
  ASSERT_FALSE(row.ok());
  EXPECT_NE(row.status().message().find("square, frame 2, marching-squares"), std::string::npos)
      << row.status();
}

}  // namespace
}  // namespace partiemc::evaluation
