// The generator: exact truth, true motion, the same bits everywhere.
#include "client/evaluation/scenes/scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>

#include "client/evaluation/metrics/metrics.h"
#include "client/evaluation/scenes/bodies.h"
#include "client/evaluation/scenes/segment_index.h"
#include "client/evaluation/scenes/shapes.h"

namespace partiemc::evaluation {
namespace {

// FNV-1a over the bits of every position.
std::uint64_t HashOf(const Sequence& sequence) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const SequenceFrame& frame : sequence.frames) {
    for (const double value : frame.positions) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3u;
    }
  }
  return hash;
}

const std::vector<SceneRecipe>& SmokeSet() {
  static const std::vector<SceneRecipe> recipes = Set("smoke");
  return recipes;
}

// A scene of each recipe of the smoke set, made once for all tests.
const std::vector<Sequence>& SmokeScenes() {
  static const std::vector<Sequence> scenes = [] {
    std::vector<Sequence> made;
    for (const SceneRecipe& recipe : SmokeSet()) made.push_back(MakeScene(recipe));
    return made;
  }();
  return scenes;
}

TEST(Scenes, AreTheSameToTheBitOnEveryMachine) {
  std::vector<std::uint64_t> hashes;
  for (const Sequence& scene : SmokeScenes()) hashes.push_back(HashOf(scene));
  const std::vector<std::uint64_t> expected = {
      2216791333833778893u, 6663272279083195712u,  18391811610309604616u, 12707816305507973518u,
      6424445866568516628u, 13503526350310135347u, 889300387640955821u};
  EXPECT_EQ(hashes, expected);
}

TEST(Scenes, FollowFromTheirSeedAlone) {
  SceneRecipe recipe = SmokeSet()[0];
  const Sequence once = MakeScene(recipe);
  EXPECT_EQ(HashOf(once), HashOf(MakeScene(recipe)));
  ++recipe.seed;
  EXPECT_NE(HashOf(once), HashOf(MakeScene(recipe)));
}

TEST(Scenes, KeepTheAreaOfTheirTruthUnderRigidMotionAndFlow) {
  for (const Sequence& scene : SmokeScenes()) {
    if (scene.group == Group::kTopology || scene.group == Group::kGrowth) continue;
    for (const SequenceFrame& frame : scene.frames) {
      EXPECT_NEAR(frame.area / scene.frames[0].area, 1, 1e-5) << scene.name;
      EXPECT_NEAR(SignedArea(frame.truth) / frame.area, 1, 1e-9) << scene.name;
    }
  }
}

TEST(Scenes, CarryTheirTruthFromFrameToFrameByTheirMotion) {
  for (const Sequence& scene : SmokeScenes()) {
    if (!scene.truth_follows_motion) continue;
    for (std::size_t t = 0; t + 1 < scene.frames.size(); ++t) {
      Outline carried = scene.frames[t].truth;
      scene.motion->Carry(t, carried.points);
      for (std::size_t k = 0; k < carried.points.size(); k += 50) {
        EXPECT_LT(Length(carried.points[k] - scene.frames[t + 1].truth.points[k]),
                  1e-9 * scene.spacing)
            << scene.name << " frame " << t;
      }
    }
  }
}

TEST(Scenes, HaveVolumesThatAddUpToTheTrueArea) {
  for (const Sequence& scene : SmokeScenes()) {
    for (const SequenceFrame& frame : scene.frames) {
      const double sum = frame.volumes[0] * static_cast<double>(frame.ParticleCount());
      EXPECT_NEAR(sum / frame.area, 1, 1e-6) << scene.name;
    }
    EXPECT_NEAR(scene.frames[0].volumes[0] / (scene.spacing * scene.spacing), 1, 1e-6);
  }
}

// Each particle's position by its id; no two share one.
std::map<std::uint64_t, Point> ById(const SequenceFrame& frame) {
  EXPECT_EQ(frame.ids.size(), frame.ParticleCount());
  std::map<std::uint64_t, Point> places;
  for (std::size_t k = 0; k < frame.ids.size(); ++k) {
    const Point place{frame.positions[2 * k], frame.positions[2 * k + 1]};
    EXPECT_TRUE(places.emplace(frame.ids[k], place).second) << frame.ids[k];
  }
  return places;
}

TEST(Scenes, CarryTheParticlesOfAnIdByTheirMotion) {
  for (std::size_t k = 0; k < SmokeScenes().size(); ++k) {
    const SceneRecipe& recipe = SmokeSet()[k];
    const Sequence& scene = SmokeScenes()[k];
    if (recipe.group == Group::kTopology) continue;
    SCOPED_TRACE(recipe.name);
    // Noise is new in every frame; where a region grows, its particles settle.
    const double slack = recipe.group == Group::kNoise    ? 12 * recipe.noise
                         : recipe.group == Group::kGrowth ? 1.5
                                                          : 1e-9;
    for (std::size_t t = 0; t + 1 < scene.frames.size(); ++t) {
      const auto next = ById(scene.frames[t + 1]);
      for (const auto& [id, place] : ById(scene.frames[t])) {
        std::array carried = {place};
        scene.motion->Carry(t, carried);
        ASSERT_TRUE(next.contains(id)) << id;
        EXPECT_LT(Length(next.at(id) - carried[0]), slack * scene.spacing) << id << " frame " << t;
      }
    }
  }
}

TEST(Scenes, TellTheParticlesOfEachBodyApart) {
  for (const bool reversed : {false, true}) {
    const Sequence scene = MakeScene({.name = "chain",
                                      .group = Group::kTopology,
                                      .shape = "disc-chain",
                                      .seed = 3,
                                      .particles = 600,
                                      .reversed = reversed});
    std::map<std::uint64_t, Point> steps;  // A body's own, the same in every frame.
    std::set<std::size_t> counts;
    for (std::size_t t = 0; t + 1 < scene.frames.size(); ++t) {
      const auto next = ById(scene.frames[t + 1]);
      counts.insert(next.size());
      for (const auto& [id, place] : ById(scene.frames[t])) {
        const auto found = next.find(id);
        if (found == next.end()) continue;
        const Point step = found->second - place;
        const Point known = steps.emplace(id, step).first->second;
        EXPECT_LT(Length(step - known), 1e-9 * scene.spacing) << id << " frame " << t;
      }
    }
    EXPECT_GT(counts.size(), 1u) << "particles vanish or appear";
  }
}

TEST(Scenes, ThinnedOnesTellBothSpacings) {
  SceneRecipe recipe;
  recipe.group = Group::kThinned;
  recipe.kept_share = 0.5;
  const Sequence scene = MakeScene(recipe);
  EXPECT_NEAR(scene.spacing / scene.original_spacing, std::sqrt(2), 2e-3);
  EXPECT_TRUE(scene.judged);
  recipe.kept_share = 0.3;
  EXPECT_FALSE(MakeScene(recipe).judged);
}

TEST(Sampling, RelaxedCentresKeepHalfASpacingFromTheBoundaryAndFromEachOther) {
  Random random(3);
  for (const std::string_view shape : {"disc", "square", "annulus"}) {
    const Outline region = MakeShape(shape, 700, 0.25);
    const SegmentIndex boundary(region, 0.5);
    const auto centers = Sample(region, Sampling::kRelaxed, false, random);
    EXPECT_EQ(centers.size(), static_cast<std::size_t>(std::lround(SignedArea(region))));
    for (std::size_t k = 0; k < centers.size(); ++k) {
      EXPECT_GT(boundary.SignedDistance(centers[k]), 0.499) << shape << " seed 3";
      for (std::size_t j = 0; j < k; ++j) EXPECT_GT(Length(centers[k] - centers[j]), 0.5);
    }
  }
}

// Mean and standard deviation of the nearest neighbours over several shapes, and particles for each
// area of 1.
struct Density {
  NeighbourDistances distances;
  double per_area = 0;
};

Density DensityOf(Sampling sampling) {
  Random random(31);
  Density all;
  constexpr std::array<std::string_view, 4> kShapes = {"disc", "square", "clover", "annulus"};
  for (const std::string_view shape : kShapes) {
    const Outline region = MakeShape(shape, 1200, 0.25);
    const auto centers = Sample(region, sampling, false, random);
    std::vector<double> positions;
    for (const Point& p : centers) positions.insert(positions.end(), {p.x, p.y});
    const NeighbourDistances distances = NearestNeighbours(positions, 1);
    all.distances.mean += distances.mean / kShapes.size();
    all.distances.deviation += distances.deviation / kShapes.size();
    all.per_area += static_cast<double>(centers.size()) / SignedArea(region) / kShapes.size();
  }
  return all;
}

TEST(Sampling, HasTheNearestNeighboursThatItsNamePromises) {
  struct Range {
    Sampling sampling;
    double mean_low, mean_high, deviation_low, deviation_high;
  };
  constexpr Range kRanges[] = {
      {Sampling::kLattice, 0.999999, 1.000001, 0, 1e-6},
      {Sampling::kHexagonal, 1.0745, 1.0746, 0, 1e-6},
      {Sampling::kRelaxed, 0.90, 0.96, 0.06, 0.10},
      {Sampling::kRelaxedLong, 0.90, 0.96, 0.06, 0.10},
      {Sampling::kSettled, 0.90, 0.96, 0.06, 0.10},
      {Sampling::kBlueNoise, 0.80, 0.85, 0.05, 0.09},
      {Sampling::kClumped, 0.56, 0.62, 0.21, 0.25},  // As a dam break after its wave broke.
      {Sampling::kRagged, 0.80, 0.86, 0.06, 0.11},
  };
  for (const Range& range : kRanges) {
    SCOPED_TRACE(std::string(Name(range.sampling)) + " seed 31");
    const Density density = DensityOf(range.sampling);
    EXPECT_GE(density.distances.mean, range.mean_low);
    EXPECT_LE(density.distances.mean, range.mean_high);
    EXPECT_GE(density.distances.deviation, range.deviation_low);
    EXPECT_LE(density.distances.deviation, range.deviation_high);
    EXPECT_NEAR(density.per_area, 1, 0.02);
  }
}

TEST(Sampling, NearestNeighboursAreWhatAllPairsSay) {
  Random random(17);
  std::vector<double> positions;
  for (int k = 0; k < 400; ++k) positions.push_back(random.Uniform(0, 20));
  positions.insert(positions.end(), {500, 500});  // Spray: left out.
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < positions.size(); i += 2) {
    double nearest = 2;
    for (std::size_t j = 0; j < positions.size(); j += 2) {
      const Point arm = {positions[i] - positions[j], positions[i + 1] - positions[j + 1]};
      if (i != j) nearest = std::min(nearest, Length(arm));
    }
    if (nearest == 2) continue;
    sum += nearest;
    ++count;
  }
  const NeighbourDistances distances = NearestNeighbours(positions, 1);
  EXPECT_NEAR(distances.mean, sum / count, 1e-12) << "seed 17";
  // In units twice as long: the same neighbours within twice the reach.
  for (double& x : positions) x *= 2;
  EXPECT_NEAR(NearestNeighbours(positions, 2).mean, distances.mean, 1e-12);
  EXPECT_EQ(NearestNeighbours({}, 1).mean, 0);
}

TEST(Sampling, ClumpsKeepTheirDensityUpToTheBoundary) {
  Random random(29);
  std::array<double, 4> counts = {};
  std::array<double, 4> areas = {};
  for (int round = 0; round < 4; ++round) {
    const Outline region = MakeShape("disc", 2000, 0.25);
    const SegmentIndex boundary(region, 0.5);
    const double radius = std::sqrt(2000 / std::numbers::pi);
    for (const Point& p : Sample(region, Sampling::kClumped, false, random)) {
      const double depth = boundary.SignedDistance(p);
      EXPECT_GT(depth, 0) << "seed 29";
      if (depth < 4) ++counts[static_cast<std::size_t>(depth)];
    }
    for (int k = 0; k < 4; ++k) {
      areas[k] +=
          std::numbers::pi * ((radius - k) * (radius - k) - (radius - k - 1) * (radius - k - 1));
    }
  }
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(counts[k] / areas[k], 1, 0.12) << "layer " << k;
}

TEST(Sampling, LatticesFitWithoutARemainder) {
  Random random(5);
  for (const std::string_view shape :
       {"square", "ell", "bar", "cross", "rectangle", "frame", "comb"}) {
    const Outline region = MakeShape(shape, 800, 0.25);
    ASSERT_TRUE(FitsLattice(shape));
    const auto centers = Sample(region, Sampling::kLattice, true, random);
    EXPECT_EQ(static_cast<double>(centers.size()), std::round(SignedArea(region))) << shape;
  }
}

TEST(Sampling, RaggedCentresDoNotCrowdAtTheBoundary) {
  Random random(9);
  double inside = 0, near = 0, near_area = 0;
  for (int round = 0; round < 4; ++round) {
    const Outline region = MakeShape("square", 2500, 0.25);
    const SegmentIndex boundary(region, 0.5);
    for (const Point& p : Sample(region, Sampling::kRagged, false, random)) {
      ++inside;
      if (boundary.SignedDistance(p) < 0.5) ++near;
    }
    near_area += 2500 - 49.0 * 49.0;
  }
  EXPECT_NEAR(inside / (4 * 2500), 1, 0.02) << "seed 9";
  EXPECT_NEAR(near / near_area, 1, 0.15) << "seed 9";
}

TEST(Bodies, UniteToTheAreaThatTheFormulaOfTwoDiscsSays) {
  const double r = 12, s = 9, d = 15;
  const std::vector<Body> bodies = {{r, r, 0, {0, 0}, {}}, {s, s, 0, {d, 0}, {}}};
  const double alpha = std::acos((d * d + r * r - s * s) / (2 * d * r));
  const double beta = std::acos((d * d + s * s - r * r) / (2 * d * s));
  const double common =
      r * r * (alpha - std::sin(2 * alpha) / 2) + s * s * (beta - std::sin(2 * beta) / 2);
  const Outline outline = UnionOutline(bodies, 0);
  EXPECT_EQ(outline.LoopCount(), 1u);
  EXPECT_NEAR(SignedArea(outline), std::numbers::pi * (r * r + s * s) - common, 2e-3);
}

TEST(Bodies, ApartHaveAnOutlineEach) {
  const std::vector<Body> bodies = {{5, 5, 0, {0, 0}, {}}, {5, 5, 0, {20, 0}, {-3, 0}}};
  EXPECT_EQ(UnionOutline(bodies, 0).LoopCount(), 2u);
  EXPECT_EQ(UnionOutline(bodies, 4).LoopCount(), 1u);
}

TEST(Bodies, InARingLeaveAHole) {
  std::vector<Body> bodies;
  for (int k = 0; k < 5; ++k) {
    const double angle = 2 * std::numbers::pi * k / 5;
    bodies.push_back({7, 7, 0, {10 * std::cos(angle), 10 * std::sin(angle)}, {}});
  }
  const LoopCounts counts = CountLoops(UnionOutline(bodies, 0));
  EXPECT_EQ(counts.outer, 1u);
  EXPECT_EQ(counts.holes, 1u);
}

TEST(Sets, HaveASimpleTruthAndParticlesToMatchWhereBodiesMergeAndSplit) {
  for (const std::string_view name : {"tuning", "validation"}) {
    for (const SceneRecipe& recipe : Set(name)) {
      if (recipe.group != Group::kTopology) continue;
      const Sequence scene = MakeScene(recipe);
      std::set<std::size_t> components;
      for (const SequenceFrame& frame : scene.frames) {
        EXPECT_EQ(SegmentIndex(frame.truth, scene.spacing).CountCrossings(), 0u) << scene.name;
        const double covered =
            static_cast<double>(frame.ParticleCount()) * scene.spacing * scene.spacing;
        EXPECT_NEAR(covered / frame.area, 1, 0.015) << scene.name;
        components.insert(CountLoops(frame.truth).outer);
      }
      EXPECT_GE(components.size(), 2u) << scene.name;
      EXPECT_EQ(*components.begin(), 1u) << scene.name;
    }
  }
}

// How many judged sequences of a set are of a group and, if one is given, of a sampling.
std::size_t CountOf(const std::vector<SceneRecipe>& set, Group group,
                    std::optional<Sampling> sampling = std::nullopt) {
  return static_cast<std::size_t>(std::ranges::count_if(set, [&](const SceneRecipe& recipe) {
    return recipe.group == group && recipe.kept_share > 0.4 &&
           (!sampling || recipe.sampling == *sampling);
  }));
}

TEST(Sets, AreLargeEnoughAndShareNoShapeAndNoSeed) {
  const auto tuning = Set("tuning");
  const auto validation = Set("validation");
  std::set<std::string> tuning_shapes, validation_shapes, names;
  std::set<std::uint64_t> seeds;
  for (const SceneRecipe& recipe : tuning) {
    tuning_shapes.insert(recipe.shape);
    EXPECT_TRUE(seeds.insert(recipe.seed).second) << recipe.name;
    EXPECT_TRUE(names.insert(recipe.name).second) << recipe.name;
  }
  names.clear();
  for (const SceneRecipe& recipe : validation) {
    validation_shapes.insert(recipe.shape);
    EXPECT_EQ(tuning_shapes.count(recipe.shape), 0u) << recipe.name;
    EXPECT_TRUE(seeds.insert(recipe.seed).second) << recipe.name;
    EXPECT_TRUE(names.insert(recipe.name).second) << recipe.name;
  }
  EXPECT_EQ(tuning_shapes.size(), TuningShapes().size() + 8) << "all, and the bodies that merge";
  EXPECT_EQ(validation_shapes.size(), ValidationShapes().size() + 4);
  for (const auto& set : {tuning, validation}) {
    for (int group = 0; group <= static_cast<int>(Group::kGrowth); ++group) {
      EXPECT_GE(CountOf(set, static_cast<Group>(group)), 8u) << Name(static_cast<Group>(group));
    }
    for (const SceneRecipe& recipe : set) {
      EXPECT_EQ(recipe.frames, 8u) << recipe.name;
      EXPECT_GE(recipe.particles, 500u) << recipe.name;
      EXPECT_LE(recipe.particles, 3600u) << recipe.name << ": thinned ones begin with 600 more";
    }
  }
  EXPECT_TRUE(Set("nonsense").empty());
}

TEST(Sets, HaveEverySamplerTwiceOnEveryKindOfMotion) {
  for (const std::string_view name : {"tuning", "validation"}) {
    const auto set = Set(name);
    for (const Group group : {Group::kRigid, Group::kDeformed, Group::kTopology, Group::kGrowth}) {
      for (const Sampling sampling : kSamplers) {
        EXPECT_GE(CountOf(set, group, sampling), 2u)
            << name << ' ' << Name(group) << ' ' << Name(sampling);
      }
    }
  }
}

TEST(Sets, SmokeIsSmallAndHasEveryGroup) {
  for (int group = 0; group <= static_cast<int>(Group::kGrowth); ++group) {
    EXPECT_EQ(CountOf(SmokeSet(), static_cast<Group>(group)), 1u);
  }
  for (const SceneRecipe& recipe : SmokeSet()) EXPECT_LE(recipe.particles, 500u);
}

TEST(Sets, DiscsAreRelaxedShortAndLongStillAndTurning) {
  const auto discs = Set("discs");
  EXPECT_EQ(discs.size(), 32u);
  for (const std::string_view shape : {"disc", "ellipse"}) {
    for (const Sampling sampling : {Sampling::kRelaxed, Sampling::kRelaxedLong}) {
      for (const Pace pace : {Pace::kStill, Pace::kTurn}) {
        EXPECT_EQ(std::ranges::count_if(discs,
                                        [&](const SceneRecipe& r) {
                                          return r.shape == shape && r.sampling == sampling &&
                                                 r.pace == pace && r.particles >= 500 &&
                                                 r.particles <= 3000;
                                        }),
                  4);
      }
    }
  }
  const Sequence still = MakeScene(discs[0]);
  EXPECT_EQ(still.frames.front().positions, still.frames.back().positions);
  const Sequence turning = MakeScene(discs[4]);
  Point before, after;
  for (const Point& p : turning.frames.front().truth.points) before = before + p;
  for (const Point& p : turning.frames.back().truth.points) after = after + p;
  const double count = static_cast<double>(turning.frames.front().truth.points.size());
  EXPECT_LT(Length((1 / count) * (after - before)), 1e-6 * turning.spacing) << "it stays in place";
  EXPECT_NE(turning.frames.front().positions, turning.frames.back().positions);
}

// The validation set is for one look. Whoever changes a sampler, a shape or a motion changes it:
// then it needs new seeds as well, and a new number here before it is evaluated.
TEST(Sets, TheValidationSetIsTheOneThatWasCommittedBeforeItWasRead) {
  std::uint64_t digest = 0xcbf29ce484222325u;
  for (const SceneRecipe& recipe : Set("validation")) {
    digest = (digest ^ HashOf(MakeScene(recipe))) * 0x100000001b3u;
  }
  EXPECT_EQ(digest, 3238927864225870373u);
}

}  // namespace
}  // namespace partiemc::evaluation
