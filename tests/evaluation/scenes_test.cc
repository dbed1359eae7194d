// The generator: exact truth, true motion, the same bits everywhere.
#include "evaluation/scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string>

#include "evaluation/bodies.h"
#include "evaluation/metrics.h"
#include "evaluation/segment_index.h"
#include "evaluation/shapes.h"

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
      2216791333833778893u,  6663272279083195712u,  18391811610309604616u, 15409351899973392682u,
      15995984778273249110u, 13503526350310135347u, 18285851617369590694u};
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
        EXPECT_NEAR(covered / frame.area, 1, 0.01) << scene.name;
        components.insert(CountLoops(frame.truth).outer);
      }
      EXPECT_GE(components.size(), 2u) << scene.name;
      EXPECT_EQ(*components.begin(), 1u) << scene.name;
    }
  }
}

TEST(Sets, AreLargeEnoughAndShareNoShapeAndNoSeed) {
  const auto tuning = Set("tuning");
  const auto validation = Set("validation");
  std::set<std::string> shapes, names;
  std::set<std::uint64_t> seeds;
  for (const SceneRecipe& recipe : tuning) {
    shapes.insert(recipe.shape);
    seeds.insert(recipe.seed);
    EXPECT_TRUE(names.insert(recipe.name).second) << recipe.name;
  }
  names.clear();
  for (const SceneRecipe& recipe : validation) {
    EXPECT_EQ(shapes.count(recipe.shape), 0u) << recipe.name;
    EXPECT_EQ(seeds.count(recipe.seed), 0u) << recipe.name;
    EXPECT_TRUE(names.insert(recipe.name).second) << recipe.name;
  }
  for (const auto& set : {tuning, validation}) {
    for (int group = 0; group <= static_cast<int>(Group::kGrowth); ++group) {
      EXPECT_GE(std::count_if(set.begin(), set.end(),
                              [group](const SceneRecipe& recipe) {
                                return static_cast<int>(recipe.group) == group &&
                                       recipe.kept_share > 0.4;
                              }),
                8)
          << Name(static_cast<Group>(group));
    }
  }
  EXPECT_FALSE(!Set("nonsense").empty());
}

}  // namespace
}  // namespace partiemc::evaluation
