#include "rings/rings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "partiemc/validate.h"
#include "support/levels_by_hand.h"
#include "support/particles.h"
#include "support/stages.h"

namespace partiemc {
namespace {

using support::At;
using support::Circle;
using support::kHigh;
using support::kLow;
using support::Particles;
using support::Plain;
using support::Stages;

// Centres on and off the seams of tiles.
const std::pair<double, double> kCentres[] = {{16.2, 15.7}, {32, 32}, {31.5, 20.3}, {40.1, 33.9}};

TEST(Rings, AnAnnulusIsAnOuterRingAndAHoleInIt) {
  for (const auto& [cx, cy] : kCentres) {
    Stages stages;
    stages.RunOn(
        [cx = cx, cy = cy](int x, int y) {
          return std::max(Circle(x, y, cx, cy, 12), -Circle(x, y, cx, cy, 5));
        },
        kLow, kHigh, {}, Plain(false));
    const Rings& rings = stages.result.rings;
    ASSERT_EQ(rings.RingCount(), 2u);
    const std::size_t outer = rings.outer_of[0] == kNoRing ? 0 : 1;
    const std::size_t hole = 1 - outer;
    EXPECT_EQ(rings.outer_of[outer], kNoRing);
    EXPECT_EQ(rings.outer_of[hole], outer);
    EXPECT_NEAR(rings.measures[outer].area, std::numbers::pi * 144, 2);
    EXPECT_NEAR(rings.measures[hole].area, -std::numbers::pi * 25, 1);
    EXPECT_NEAR(rings.measures[hole].centroid_x, cx, 0.05);
    EXPECT_NEAR(rings.measures[hole].centroid_y, cy, 0.05);
    EXPECT_TRUE(Validate(stages.result).ok()) << Validate(stages.result);
  }
}

TEST(Rings, AnIslandInAHoleIsAnOuterRingOfItsOwn) {
  for (const auto& [cx, cy] : kCentres) {
    Stages stages;
    stages.RunOn(
        [cx = cx, cy = cy](int x, int y) {
          return std::min(std::max(Circle(x, y, cx, cy, 13), -Circle(x, y, cx, cy, 8)),
                          std::max(Circle(x, y, cx, cy, 5), -Circle(x, y, cx, cy, 2)));
        },
        kLow, kHigh, {}, Plain(false));
    const Rings& rings = stages.result.rings;
    ASSERT_EQ(rings.RingCount(), 4u);
    EXPECT_EQ(std::count(rings.outer_of.begin(), rings.outer_of.end(), kNoRing), 2);
    for (std::size_t ring = 0; ring < 4; ++ring) {
      if (rings.outer_of[ring] == kNoRing) continue;
      // A hole belongs to the ring just outside of it, which is the smaller one that holds it.
      const double hole = -rings.measures[ring].area;
      const double outer = rings.measures[rings.outer_of[ring]].area;
      EXPECT_NEAR(outer, std::numbers::pi * (hole > 100 ? 169 : 25), 3);
    }
    EXPECT_TRUE(Validate(stages.result).ok()) << Validate(stages.result);
  }
}

// Two blocks of 4 x 4 nodes that touch at a saddle, `inside` deep.
double DiagonalBlocks(int x, int y, double inside, double outside) {
  const bool lower = x >= 29 && x < 33 && y >= 29 && y < 33;
  const bool upper = x >= 33 && x < 37 && y >= 33 && y < 37;
  return lower || upper ? inside : outside;
}

TEST(Rings, BlobsThatTouchAtASaddleAreOneRingOrTwoAsTheDeciderSays) {
  const Particles particles = At({{30, 30}, {31, 30}, {34, 35}});
  Stages parted;
  parted.RunOn([](int x, int y) { return DiagonalBlocks(x, y, -1, 3); }, kLow, kHigh, particles,
               Plain(false));
  ASSERT_EQ(parted.topology.RingCount(), 2u);
  EXPECT_EQ(parted.topology.particle_count, (std::vector<std::uint64_t>{2, 1}));
  EXPECT_TRUE(Validate(parted.result).ok()) << Validate(parted.result);

  Stages joined;
  joined.RunOn([](int x, int y) { return DiagonalBlocks(x, y, -3, 1); }, kLow, kHigh, particles,
               Plain(false));
  ASSERT_EQ(joined.topology.RingCount(), 1u);
  EXPECT_EQ(joined.topology.particle_count, (std::vector<std::uint64_t>{3}));
  EXPECT_TRUE(Validate(joined.result).ok()) << Validate(joined.result);
}

TEST(Rings, HolesThatTouchAtASaddleAreOneRingOrTwoAsTheDeciderSays) {
  const auto block = [](double inside, double outside) {
    return [=](int x, int y) {
      if (x < 20 || x > 45 || y < 20 || y > 45) return outside;
      return -DiagonalBlocks(x, y, -outside, -inside);
    };
  };
  Stages joined;  // The fluid passes between the two holes.
  joined.RunOn(block(-3, 1), kLow, kHigh, {}, Plain(false));
  ASSERT_EQ(joined.topology.RingCount(), 3u);
  EXPECT_TRUE(Validate(joined.result).ok()) << Validate(joined.result);
  Stages parted;  // The hole passes through.
  parted.RunOn(block(-1, 3), kLow, kHigh, {}, Plain(false));
  ASSERT_EQ(parted.topology.RingCount(), 2u);
  EXPECT_TRUE(Validate(parted.result).ok()) << Validate(parted.result);
}

class RingsOfNoise : public testing::TestWithParam<int> {};

TEST_P(RingsOfNoise, AreClosedSimpleOrientedNestedAndUseEachSegmentOnce) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  const double bias = 0.1 * (GetParam() % 5) - 0.2;
  Stages stages;
  stages.RunOn(
      [=](int x, int y) {
        if (x <= 0 || y <= 0 || x >= 63 || y >= 63) return 1.0;
        support::Random random(seed * 1'000'003 + static_cast<std::uint64_t>(y * 64 + x));
        return random.Uniform(-1, 1) + bias;
      },
      kLow, kHigh, {}, Plain(false));
  const RingTopology& rings = stages.topology;
  std::vector<int> used(stages.crossings.segments.size());
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t first = rings.offsets[ring];
    const std::uint32_t last = rings.offsets[ring + 1];
    for (std::uint32_t k = first; k < last; ++k) {
      ++used[rings.segments[k]];
      EXPECT_EQ(NextSegment(stages.bins.tiles, stages.crossings, rings.segments[k]),
                rings.segments[k + 1 < last ? k + 1 : first]);
    }
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), 1), static_cast<std::ptrdiff_t>(used.size()));
  EXPECT_TRUE(Validate(stages.result).ok()) << Validate(stages.result);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RingsOfNoise, testing::Range(1, 16));

TEST(Rings, NothingAtAllHasNoRings) {
  Stages stages;
  stages.Run({}, {.spacing = 1.0});
  EXPECT_EQ(stages.topology.RingCount(), 0u);
  EXPECT_EQ(stages.topology.offsets, std::vector<std::uint32_t>{0});
}

}  // namespace
}  // namespace partiemc
