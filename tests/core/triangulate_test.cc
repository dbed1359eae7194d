#include "mesh/triangulate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/predicates.h"
#include "region_cover.h"
#include "region_shapes.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Cells;
using support::ExpectCover;
using support::RandomEngine;
using support::Rectangle;
using support::Region;
using support::RegionOf;
using support::Reversed;

std::optional<std::vector<std::uint32_t>> Triangulate(const Region& region) {
  std::vector<std::uint32_t> triangles;
  Triangulator triangulator;
  if (!triangulator.Triangulate(region.points, region.loop_points, region.loop_offsets,
                                triangles)) {
    EXPECT_TRUE(triangles.empty());
    return std::nullopt;
  }
  return triangles;
}

/// Number of triangles of a region without pinches.
std::size_t ExpectedCount(const Region& region) {
  std::size_t count = region.loop_points.size();
  for (std::size_t loop = 0; loop < region.LoopCount(); ++loop) {
    count += support::DoubleArea(region.Loop(loop)) > 0 ? -2 : 2;
  }
  return count;
}

void ExpectTriangulated(const Region& region) {
  const auto triangles = Triangulate(region);
  ASSERT_TRUE(triangles.has_value());
  EXPECT_EQ(triangles->size(), 3 * ExpectedCount(region));
  ExpectCover(region, *triangles);
}

TEST(Triangulator, TriangleStaysUnchanged) {
  EXPECT_EQ(Triangulate(RegionOf({{{0, 0}, {2, 0}, {1, 1}}})),
            (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(Triangulator, NoLoopsMakeNoTriangles) {
  EXPECT_EQ(Triangulate(Region{}), std::vector<std::uint32_t>{});
}

TEST(Triangulator, FailureLeavesTrianglesUnchanged) {
  const Region square = RegionOf({Rectangle(0, 0, 1, 1)});
  // The sweep reaches the second loop after it has triangulated the first one.
  const Region spoiled = RegionOf({Rectangle(0, 0, 1, 1), {{0, 2}, {1, 3}, {1, 2}, {0, 3}}});
  std::vector<std::uint32_t> triangles{7, 8, 9};
  Triangulator triangulator;
  EXPECT_FALSE(triangulator.Triangulate(spoiled.points, spoiled.loop_points, spoiled.loop_offsets,
                                        triangles));
  EXPECT_EQ(triangles, (std::vector<std::uint32_t>{7, 8, 9}));
  EXPECT_TRUE(
      triangulator.Triangulate(square.points, square.loop_points, square.loop_offsets, triangles));
  EXPECT_EQ(triangles.size(), 9u);
  EXPECT_EQ(triangles[0], 7u);
}

TEST(Triangulator, HolesIslandsAndComponentsNest) {
  ExpectTriangulated(RegionOf({Rectangle(0, 0, 10, 10), Reversed(Rectangle(1, 1, 9, 9)),
                               Rectangle(2, 2, 8, 8), Reversed(Rectangle(3, 3, 5, 5)),
                               Reversed(Rectangle(6, 3, 7, 5)), Rectangle(20, 0, 21, 10)}));
}

TEST(Triangulator, CollinearPointsMakeNoDegenerateTriangle) {
  std::vector<Point> loop;
  for (int i = 0; i < 5; ++i) loop.push_back({static_cast<double>(i), 0});
  for (int i = 0; i < 5; ++i) loop.push_back({5, static_cast<double>(i)});
  for (int i = 5; i > 0; --i) loop.push_back({static_cast<double>(i), 5});
  for (int i = 5; i > 0; --i) loop.push_back({0, static_cast<double>(i)});
  ExpectTriangulated(RegionOf({loop}));
  std::vector<Point> hole = loop;
  for (Point& point : hole) point = {0.3 + 0.5 * point.x, 0.3 + 0.5 * point.y};
  ExpectTriangulated(RegionOf({loop, Reversed(hole)}));
}

TEST(Triangulator, AcceptsHolesThatPinch) {
  Region region;
  // A square whose corner (0, 0) is shared by a hole, which shares another point with a second
  // hole.
  region.AddLoop(Rectangle(0, 0, 10, 10));
  const std::uint32_t shared = region.AddPoint({4, 4});
  region.AddLoop({0, region.AddPoint({2, 4}), shared, region.AddPoint({4, 2})});
  // Another point at the position of `shared`.
  region.AddLoop(Reversed({{4, 4}, {6, 4}, {6, 6}, {4, 6}}));
  const auto triangles = Triangulate(region);
  ASSERT_TRUE(triangles.has_value());
  ExpectCover(region, *triangles);
  // Pinches connect all three loops: one loop of 12 points bounds the inside.
  EXPECT_EQ(triangles->size() / 3, 12u - 2);
}

TEST(Triangulator, AcceptsLoopThatPassesAPointTwice) {
  Region one, two;
  for (Region* region : {&one, &two}) {
    for (const Point& point : {Point{0, 0}, {1, 0}, {1, 1}, {0, 1}, {2, 1}, {2, 2}, {1, 2}}) {
      region->AddPoint(point);
    }
  }
  one.AddLoop({0u, 1u, 2u, 4u, 5u, 6u, 2u, 3u});
  two.AddLoop({0u, 1u, 2u, 3u});
  two.AddLoop({2u, 4u, 5u, 6u});
  const auto triangles = Triangulate(one);
  ASSERT_TRUE(triangles.has_value());
  EXPECT_EQ(triangles->size() / 3, 4u);
  ExpectCover(one, *triangles);
  EXPECT_EQ(triangles, Triangulate(two));
}

TEST(Triangulator, StarsSpiralsAndCombsAreCovered) {
  RandomEngine random(20);
  for (const std::size_t count : {3u, 4u, 7u, 50u, 1000u}) {
    SCOPED_TRACE("seed 20, count " + std::to_string(count));
    ExpectTriangulated(RegionOf({support::RandomStar(random, count)}));
    ExpectTriangulated(RegionOf({support::Comb(random, count)}));
    ExpectTriangulated(RegionOf({support::HangingComb(random, count)}));
    if (count >= 50) ExpectTriangulated(RegionOf({support::Spiral(count, 3)}));
  }
}

TEST(Triangulator, ContoursAreCoveredAtAnyScaleAndPosition) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomEngine random(seed);
    const Region region = support::RandomContours(random, 10 + seed);
    ExpectTriangulated(region);
    ExpectTriangulated(region.Transformed(1e-30, 0));
    ExpectTriangulated(region.Transformed(1e30, 0));
    ExpectTriangulated(region.Transformed(0.01, 1e4));
  }
}

/// Expected number of triangles: the inside angles at all points, in units of a half turn.
std::size_t ExpectedCount(const Region& staircases, const Cells& cells) {
  std::size_t quarters = 0;
  for (std::size_t i = 0; i < staircases.points.size() / 2; ++i) {
    const auto x = static_cast<std::ptrdiff_t>(staircases.points[2 * i]);
    const auto y = static_cast<std::ptrdiff_t>(staircases.points[2 * i + 1]);
    for (const auto& [dx, dy] : {std::pair{0, 0}, {-1, 0}, {0, -1}, {-1, -1}}) {
      quarters += cells.At(x + dx, y + dy) ? 1 : 0;
    }
  }
  return quarters / 2;
}

TEST(Triangulator, UnionsOfRandomLatticeCellsWithPinchesAreCovered) {
  for (std::uint64_t seed = 0; seed < support::Tries(300u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomEngine random(seed);
    const Cells cells = support::RandomCells(random, 3 + seed % 17, 3 + seed % 13,
                                             0.3 + 0.001 * static_cast<double>(seed));
    const Region region = support::Staircases(cells, random, seed % 2 == 0);
    const auto triangles = Triangulate(region);
    ASSERT_TRUE(triangles.has_value());
    EXPECT_EQ(triangles->size() / 3, ExpectedCount(region, cells));
    ExpectCover(region, *triangles);
    const Region far = region.Transformed(0.5, 1e6);
    EXPECT_EQ(Triangulate(far), triangles);
  }
}

TEST(Triangulator, BandsBetweenContoursAndStaircasesAreCovered) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomEngine random(seed);
    const Region band = support::RandomBand(random, 12 + seed);
    const auto triangles = Triangulate(band);
    ASSERT_TRUE(triangles.has_value());
    ExpectCover(band, *triangles);
  }
}

TEST(Triangulator, AHundredThousandPointsAreCovered) {
  RandomEngine random(5);
  ExpectTriangulated(RegionOf({support::RandomStar(random, 100'000)}));
  ExpectTriangulated(RegionOf({support::Comb(random, 33'000)}));
  ExpectTriangulated(support::RandomContours(random, 300).Transformed(1, 1e6));
}

TEST(Triangulator, EarlierInputHasNoEffect) {
  RandomEngine random(6);
  Triangulator warm;
  for (int round = 0; round < 20; ++round) {
    const Region region = support::RandomContours(random, 10 + random() % 30);
    std::vector<std::uint32_t> triangles;
    ASSERT_TRUE(
        warm.Triangulate(region.points, region.loop_points, region.loop_offsets, triangles));
    EXPECT_EQ(triangles, Triangulate(region)) << "seed 6, round " << round;
  }
}

// --- Input that breaks the requirements ---------------------------------------------------------

TEST(Triangulator, FindsEachBrokenRequirement) {
  EXPECT_FALSE(Triangulate(RegionOf({{{0, 0}, {1, 1}, {1, 0}, {0, 1}}}))) << "crosses itself";
  EXPECT_FALSE(Triangulate(RegionOf({Reversed(Rectangle(0, 0, 1, 1))}))) << "hole in nothing";
  EXPECT_FALSE(Triangulate(RegionOf({Rectangle(0, 0, 3, 3), Rectangle(1, 1, 2, 2)}))) << "twice";
  EXPECT_FALSE(Triangulate(RegionOf({Rectangle(0, 0, 2, 2), Rectangle(1, 1, 3, 3)}))) << "cross";
  EXPECT_FALSE(Triangulate(RegionOf({Rectangle(0, 0, 1, 1), Rectangle(1, 0, 2, 1)})))
      << "overlapping edges";
  EXPECT_FALSE(Triangulate(RegionOf({Rectangle(0, 0, 2, 2), {{2, 1}, {3, 0.5}, {3, 1.5}}})))
      << "point on an edge";
  EXPECT_FALSE(Triangulate(RegionOf({{{0, 0}, {1, 0}, {2, 0}}}))) << "flat";
  EXPECT_FALSE(Triangulate(RegionOf({{{0, 0}, {1, 0}, {1, 0}, {1, 1}}}))) << "edge without length";
  EXPECT_FALSE(Triangulate(RegionOf({{{0, 0}, {1, 0}}}))) << "two points";
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(), 1e200, 1e-200}) {
    EXPECT_FALSE(Triangulate(RegionOf({{{0, 0}, {1, 0}, {0, bad}}}))) << bad;
  }
}

TEST(Triangulator, FindsWrongIndicesAndOffsets) {
  const std::vector<double> points{0, 0, 1, 0, 0, 1};
  const auto accepts = [&](const std::vector<std::uint32_t>& loop_points,
                           const std::vector<std::uint32_t>& loop_offsets) {
    std::vector<std::uint32_t> triangles;
    return Triangulator().Triangulate(points, loop_points, loop_offsets, triangles);
  };
  EXPECT_TRUE(accepts({0, 1, 2}, {0, 3}));
  EXPECT_FALSE(accepts({0, 1, 3}, {0, 3}));
  EXPECT_FALSE(accepts({0, 1, 0xffffffff}, {0, 3}));
  EXPECT_FALSE(accepts({0, 1, 2}, {}));
  EXPECT_FALSE(accepts({0, 1, 2}, {0}));
  EXPECT_FALSE(accepts({0, 1, 2}, {1, 3}));
  EXPECT_FALSE(accepts({0, 1, 2}, {0, 4}));
  EXPECT_FALSE(accepts({0, 1, 2}, {0, 0, 3}));
  EXPECT_FALSE(accepts({0, 1, 2}, {0, 0xffffffff, 3}));
  EXPECT_FALSE(accepts({0, 1, 2, 0, 1, 2}, {0, 6, 3, 6}));
}

/// Winding number of all loops round a point off their edges.
int Winding(const Region& region, const Point& point) {
  int winding = 0;
  for (std::size_t k = 0; k < region.LoopCount(); ++k) {
    const std::vector<Point> loop = region.Loop(k);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point& a = loop[i];
      const Point& b = loop[(i + 1) % loop.size()];
      if ((a.y <= point.y) == (b.y <= point.y)) continue;
      const int side = Orientation(a, b, point);
      if (side == (a.y < b.y ? 1 : -1)) winding += side;
    }
  }
  return winding;
}

/// The requirements of Triangulate, checked directly, for points of a lattice of spacing 1.
bool IsRegion(const Region& region) {
  std::vector<std::pair<Point, Point>> edges;
  for (std::size_t k = 0; k < region.LoopCount(); ++k) {
    const std::vector<Point> loop = region.Loop(k);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      edges.push_back({loop[i], loop[(i + 1) % loop.size()]});
      if (edges.back().first == edges.back().second) return false;
    }
  }
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto& [a, b] = edges[i];
    for (std::size_t j = 0; j < i; ++j) {
      const auto& [c, d] = edges[j];
      if (!SegmentsTouch(a, b, c, d)) continue;
      const int common = (a == c) + (a == d) + (b == c) + (b == d);
      if (common != 1) return false;
      // If two edges share one end, neither may contain the other end of the other edge.
      const bool collinear = Orientation(a, b, c) == 0 && Orientation(a, b, d) == 0;
      const Point& corner = a == c || a == d ? a : b;
      const Point& end = a == corner ? b : a;
      const Point& other = c == corner ? d : c;
      if (collinear && SweepsBefore(corner, end) == SweepsBefore(corner, other)) return false;
    }
  }
  for (const auto& [a, b] : edges) {
    const Point middle{(a.x + b.x) / 2, (a.y + b.y) / 2};
    const Point left{1e-4 * (a.y - b.y), 1e-4 * (b.x - a.x)};
    if (Winding(region, {middle.x + left.x, middle.y + left.y}) != 1) return false;
    if (Winding(region, {middle.x - left.x, middle.y - left.y}) != 0) return false;
  }
  return true;
}

TEST(Triangulator, AcceptsRandomLoopsExactlyWhenTheyBoundARegion) {
  RandomEngine random(7);
  std::size_t accepted = 0;
  for (int round = 0; round < support::Tries(200'000); ++round) {
    const Region region =
        support::RandomGarbage(random, 3 + round % 3, 1 + round % 3, 3 + round % 6);
    const auto triangles = Triangulate(region);
    ASSERT_EQ(triangles.has_value(), IsRegion(region)) << "seed 7, round " << round;
    if (!triangles.has_value()) continue;
    ++accepted;
    ExpectCover(region, *triangles);
    ASSERT_FALSE(HasFatalFailure()) << "seed 7, round " << round;
  }
  EXPECT_GT(accepted, 1'000u);
}

TEST(Triangulator, LargeGarbageIsRefused) {
  for (std::uint64_t seed = 0; seed < support::Tries(200u); ++seed) {
    RandomEngine random(seed);
    EXPECT_FALSE(Triangulate(support::RandomGarbage(random, 2 + seed, 20, 1000)))
        << "seed " << seed;
  }
}

TEST(Triangulator, RegionWithOnePointMovedIsCoveredOrRefused) {
  for (std::uint64_t seed = 0; seed < support::Tries(500u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomEngine random(seed);
    Region region = support::RandomContours(random, 8 + seed % 20);
    if (region.points.empty()) continue;
    region.points[random() % region.points.size()] += support::Uniform(random, -3, 3);
    if (const auto triangles = Triangulate(region)) ExpectCover(region, *triangles);
  }
}

}  // namespace
}  // namespace partiemc
