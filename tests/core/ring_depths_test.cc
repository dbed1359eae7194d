#include "vertices/ring_depths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numbers>
#include <vector>

#include "base/predicates.h"
#include "region_shapes.h"
#include "support/tries.h"
#include "vertices/intersections.h"

namespace partiemc {
namespace {

using support::RandomEngine;
using support::Region;
using support::RegionOf;

std::vector<std::int32_t> DepthsOf(const Region& region, RingDepths& nesting) {
  nesting.Find(region.points, region.loop_offsets);
  std::vector<std::int32_t> depths;
  for (std::size_t k = 0; k < region.LoopCount(); ++k) depths.push_back(nesting.DepthOf(k));
  return depths;
}

std::vector<std::int32_t> Depths(const Region& region) {
  RingDepths nesting;
  return DepthsOf(region, nesting);
}

// Winding number of a ring around a point, computed from all segments.
int WindingNumber(const Region& region, std::size_t ring, const Point& point) {
  const std::size_t first = region.loop_offsets[ring], last = region.loop_offsets[ring + 1];
  int winding = 0;
  for (std::size_t k = first; k < last; ++k) {
    const Point a = region.PointAt(k), b = region.PointAt(k + 1 == last ? first : k + 1);
    if ((a.y <= point.y) == (b.y <= point.y)) continue;
    const int side = Orientation(a, b, point);
    if (a.y <= point.y && side > 0) ++winding;
    if (a.y > point.y && side < 0) --winding;
  }
  return winding;
}

std::vector<std::int32_t> DepthsOneByOne(const Region& region) {
  std::vector<std::int32_t> depths;
  for (std::size_t ring = 0; ring < region.LoopCount(); ++ring) {
    int depth = 0;
    for (std::size_t other = 0; other < region.LoopCount(); ++other) {
      if (other == ring) continue;
      depth += WindingNumber(region, other, region.PointAt(region.loop_offsets[ring]));
    }
    depths.push_back(depth);
  }
  return depths;
}

// The innermost ring around a ring.
std::uint32_t AroundOneByOne(const Region& region, std::size_t ring) {
  const auto is_in = [&](std::size_t inner, std::size_t outer) {
    return WindingNumber(region, outer, region.PointAt(region.loop_offsets[inner])) != 0;
  };
  std::uint32_t around = kNoRing;
  for (std::uint32_t other = 0; other < region.LoopCount(); ++other) {
    if (other == ring || !is_in(ring, other)) continue;
    if (around == kNoRing || is_in(other, around)) around = other;
  }
  return around;
}

std::vector<Point> SquareLoop(double x, double y, double half, bool is_hole = false) {
  std::vector<Point> ring{
      {x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}};
  if (is_hole) std::reverse(ring.begin(), ring.end());
  return ring;
}

TEST(RingDepths, HolesLieInTheirOuterRings) {
  EXPECT_EQ(Depths(Region{}), std::vector<std::int32_t>{});
  EXPECT_EQ(Depths(RegionOf({SquareLoop(0, 0, 10), SquareLoop(0, 0, 5, true), SquareLoop(0, 0, 2),
                             SquareLoop(20, 0, 3), SquareLoop(0, 7, 1, true)})),
            (std::vector<std::int32_t>{0, 1, 0, 0, 1}));
}

TEST(RingDepths, NestedOuterRingsAddUp) {
  EXPECT_EQ(Depths(RegionOf({SquareLoop(0, 0, 1), SquareLoop(0, 0, 2), SquareLoop(0, 0, 3, true)})),
            (std::vector<std::int32_t>{0, -1, 0}));
  EXPECT_EQ(Depths(RegionOf({SquareLoop(0, 0, 1), SquareLoop(0, 0, 2), SquareLoop(0, 0, 3)})),
            (std::vector<std::int32_t>{2, 1, 0}));
}

TEST(RingDepths, RingIsFoundAtItsLowestPoint) {
  // Its other minima lie above a square between its legs.
  const std::vector<Point> legs{{0, 4}, {0, -1}, {1, 3}, {3, 3}, {4, 0}, {4, 4}};
  EXPECT_EQ(Depths(RegionOf({legs, SquareLoop(2, 1, 0.5)})), (std::vector<std::int32_t>{0, 0}));
}

/// Staircases have many points at one height, and horizontal sides: ties of the sweep.
TEST(RingDepths, AgreeWithWindingNumbersOfStaircases) {
  for (std::uint64_t seed = 0; seed < support::Tries(300u); ++seed) {
    RandomEngine random(seed);
    const support::Cells cells = support::RandomCells(random, 14, 14, 0.6);
    const Region staircases = support::Staircases(cells, random, seed % 2 == 0);
    Region region;
    for (std::size_t k = 0; k < staircases.LoopCount(); ++k) region.AddLoop(staircases.Loop(k));
    TouchingPairsBuffers buffers;
    if (CountTouchingPairs(region.points, region.loop_offsets, buffers) > 0) continue;
    ASSERT_EQ(Depths(region), DepthsOneByOne(region)) << "seed " << seed;
  }
}

/// Stars inside, next to and around each other, some with the wrong direction.
TEST(RingDepths, AgreeWithWindingNumbersOfStarsThatDoNotCross) {
  int nested = 0;
  RingDepths warm;
  for (std::uint64_t seed = 0; seed < support::Tries(300u); ++seed) {
    RandomEngine random(seed);
    Region region;
    TouchingPairsBuffers buffers;
    for (int tries = 0; tries < 60; ++tries) {
      std::vector<Point> ring = support::RandomStar(random, 3 + random() % 30);
      const double size = support::Uniform(random, 0.1, 8);
      const Point centre{support::Uniform(random, -8, 8), support::Uniform(random, -8, 8)};
      for (Point& point : ring) point = {centre.x + size * point.x, centre.y + size * point.y};
      if (random() % 3 == 0) std::reverse(ring.begin(), ring.end());
      Region with = region;
      with.AddLoop(ring);
      if (CountTouchingPairs(with.points, with.loop_offsets, buffers) == 0) region = with;
    }
    const std::vector<std::int32_t> expected = DepthsOneByOne(region);
    nested +=
        static_cast<int>(std::ranges::count_if(expected, [](int depth) { return depth != 0; }));
    ASSERT_EQ(DepthsOf(region, warm), expected) << "seed " << seed;
    for (std::size_t ring = 0; ring < region.LoopCount(); ++ring) {
      ASSERT_EQ(warm.AroundOf(ring), AroundOneByOne(region, ring)) << "seed " << seed;
    }
  }
  EXPECT_GT(nested, support::Tries(300));
}

}  // namespace
}  // namespace partiemc
