#include "vertices/intersections.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "base/predicates.h"
#include "region_shapes.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::RandomEngine;
using support::Rectangle;
using support::Region;
using support::RegionOf;

std::size_t Count(const Region& rings) {
  TouchingPairsBuffers buffers;
  return CountTouchingPairs(rings.points, rings.loop_offsets, buffers);
}

/// All pairs. Neighbours overlap if the shorter one's free end lies on the longer one.
std::size_t CountAllPairs(const Region& rings) {
  struct Segment {
    Point a, b;
    std::size_t index, next;
  };
  std::vector<Segment> segments;
  for (std::size_t k = 0; k < rings.LoopCount(); ++k) {
    const std::size_t begin = rings.loop_offsets[k], end = rings.loop_offsets[k + 1];
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t next = i + 1 == end ? begin : i + 1;
      segments.push_back({rings.PointAt(i), rings.PointAt(next), i, next});
    }
  }
  const auto holds = [](const Segment& segment, const Point& point) {
    return SegmentsTouch(segment.a, segment.b, point, point);
  };
  const auto overlap = [&](const Segment& first, const Segment& second) {
    if (first.a == first.b || second.a == second.b) return false;
    return holds(first, second.b) || holds(second, first.a);
  };
  std::size_t count = 0;
  for (const Segment& s : segments) {
    for (const Segment& t : segments) {
      if (s.index >= t.index) continue;
      if (s.next == t.index || t.next == s.index) {
        count += (s.next == t.index && overlap(s, t)) || (t.next == s.index && overlap(t, s));
      } else {
        count += SegmentsTouch(s.a, s.b, t.a, t.b);
      }
    }
  }
  return count;
}

TEST(CountTouchingPairs, IgnoresNeighboursOnARing) {
  EXPECT_EQ(Count(Region{}), 0u);
  EXPECT_EQ(Count(RegionOf({{{0, 0}, {1, 0}, {0, 1}}})), 0u);
  EXPECT_EQ(Count(RegionOf({{{0, 0}, {1, 0}, {2, 0}, {2, 1}, {0, 1}}})), 0u) << "straight on";
  EXPECT_EQ(Count(RegionOf({Rectangle(0, 0, 1, 1), Rectangle(2, 0, 3, 1)})), 0u);
}

TEST(CountTouchingPairs, CountsEveryKindOfTouchOnce) {
  EXPECT_EQ(Count(RegionOf({{{0, 0}, {1, 1}, {1, 0}, {0, 1}}})), 1u) << "crossing";
  EXPECT_EQ(Count(RegionOf({{{0, 0}, {2, 0}, {1, 0}, {1, 1}}})), 2u)
      << "folds back, and the side after that begins on the first side";
  EXPECT_EQ(Count(RegionOf({{{0, 0}, {1, 0}}})), 1u) << "there and back";
  EXPECT_EQ(Count(RegionOf({{{0, 0}}})), 0u) << "a point";
  EXPECT_EQ(Count(RegionOf({Rectangle(0, 0, 2, 2), {{2, 1}, {3, 0}, {3, 2}}})), 2u)
      << "a corner on a side";
  EXPECT_EQ(Count(RegionOf({Rectangle(0, 0, 1, 1), Rectangle(1, 1, 2, 2)})), 4u)
      << "two corners at one place";
}

TEST(CountTouchingPairs, ListsThePairsThatTouch) {
  TouchingPairsBuffers buffers;
  const Region rings = RegionOf({Rectangle(5, 5, 6, 6), {{0, 0}, {1, 1}, {1, 0}, {0, 1}}});
  EXPECT_EQ(CountTouchingPairs(rings.points, rings.loop_offsets, buffers), 1u);
  EXPECT_EQ(buffers.pairs, (std::vector<std::pair<std::uint32_t, std::uint32_t>>{{4, 6}}));
}

TEST(CountTouchingPairs, AgreesWithAllPairsOnDegenerateLattices) {
  RandomEngine random(8);
  for (int round = 0; round < support::Tries(20'000); ++round) {
    const Region indexed = support::RandomGarbage(random, 2 + round % 9, 4, 9);
    Region rings;
    for (std::size_t k = 0; k < indexed.LoopCount(); ++k) rings.AddLoop(indexed.Loop(k));
    ASSERT_EQ(Count(rings), CountAllPairs(rings)) << "seed 8, round " << round;
  }
}

TEST(CountTouchingPairs, AgreesWithAllPairsForMixedLengths) {
  for (std::uint64_t seed = 0; seed < support::Tries(100u); ++seed) {
    RandomEngine random(seed);
    Region rings;
    for (int k = 0; k < 20; ++k) {
      const double size = std::ldexp(1.0, -static_cast<int>(random() % (seed % 2 == 0 ? 12 : 120)));
      const Point centre{support::Uniform(random, -1, 1), support::Uniform(random, -1, 1)};
      std::vector<Point> ring = support::RandomStar(random, 3 + random() % 20);
      for (Point& point : ring) point = {centre.x + size * point.x, centre.y + size * point.y};
      rings.AddLoop(ring);
    }
    EXPECT_EQ(Count(rings), CountAllPairs(rings)) << "seed " << seed;
  }
}

TEST(CountTouchingPairs, AgreesWithAllPairsForDistantRings) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    RandomEngine random(seed);
    Region rings;
    for (int k = 0; k < 12; ++k) {
      const Point centre{10 * (k + support::Uniform(random, -1, 1)),
                         support::Uniform(random, -3, 3)};
      std::vector<Point> ring = support::RandomStar(random, 3 + random() % (k % 4 == 0 ? 600 : 60));
      for (Point& point : ring) point = {centre.x + 5 * point.x, centre.y + 5 * point.y};
      // Crossings, near each other and far apart along the ring.
      for (std::size_t swaps = random() % 3; swaps > 0; --swaps) {
        std::swap(ring[random() % ring.size()], ring[random() % ring.size()]);
      }
      rings.AddLoop(ring);
    }
    EXPECT_EQ(Count(rings), CountAllPairs(rings)) << "seed " << seed;
  }
}

/// Segments as long as cells, with ends on the borders of cells: where indices are rounded.
TEST(CountTouchingPairs, AgreesWithAllPairsAtBordersOfCells) {
  for (std::uint64_t seed = 0; seed < support::Tries(100u); ++seed) {
    RandomEngine random(seed);
    const support::Cells cells = support::RandomCells(random, 12, 12, 0.5);
    const Region staircases = support::Staircases(cells, random, seed % 2 == 0);
    Region rings;
    for (std::size_t k = 0; k < staircases.LoopCount(); ++k) rings.AddLoop(staircases.Loop(k));
    const std::size_t expected = CountAllPairs(rings);
    for (const double scale : {1.0, 0.1, 1.0 / 3, 1e-30, 1e30}) {
      EXPECT_EQ(Count(rings.Transformed(scale, 0)), expected) << "seed " << seed;
    }
    EXPECT_EQ(Count(rings.Transformed(1, 1e6)), expected) << "seed " << seed;
  }
}

TEST(CountTouchingPairs, ContoursTouchOnlyAfterAPointMoved) {
  RandomEngine random(9);
  Region rings = support::RandomContours(random, 200).Transformed(0.01, 1e3);
  ASSERT_GT(rings.loop_points.size(), 2'000u);
  EXPECT_EQ(Count(rings), 0u);
  rings.points[1000] += 0.5;
  const std::size_t count = Count(rings);
  EXPECT_GT(count, 0u);
  EXPECT_EQ(count, CountAllPairs(rings));
}

TEST(CountTouchingPairs, ReusedBuffersHaveNoEffect) {
  TouchingPairsBuffers warm;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    RandomEngine random(seed);
    Region rings = support::RandomContours(random, 10 + seed % 40);
    if (rings.points.size() > 20) rings.points[12] += support::Uniform(random, -5, 5);
    EXPECT_EQ(CountTouchingPairs(rings.points, rings.loop_offsets, warm), Count(rings))
        << "seed " << seed;
  }
}

}  // namespace
}  // namespace partiemc
