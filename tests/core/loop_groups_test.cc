#include "mesh/loop_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "partiemc/arena.h"
#include "region_cover.h"
#include "region_shapes.h"

namespace partiemc {
namespace {

using support::ExpectCover;
using support::RandomEngine;
using support::Rectangle;
using support::Region;
using support::Reversed;

/// Separate regions of all kinds: suitable for a strip, unsuitable, with one loop or many.
std::vector<Region> AllKindsOfRegions(std::size_t count) {
  RandomEngine random(8);
  std::vector<Region> regions;
  for (std::size_t k = 0; k < count; ++k) {
    Region region;
    switch (k % 4) {
      case 0:
        region.AddLoop(Rectangle(0, 0, 40, 40));
        region.AddLoop(Reversed(Rectangle(1, 1, 39, 39)));
        break;
      case 1:
        region.AddLoop(Rectangle(-20, -20, 60, 60));
        region.AddLoop(Reversed(support::Comb(random, 1 + random() % 20)));
        break;
      case 2:
        region = support::RandomBand(random, 10 + random() % 20);
        break;
      default:
        region.AddLoop(support::RandomStar(random, 3 + random() % 100));
    }
    if (region.LoopCount() == 0) continue;
    regions.push_back(region.Transformed(1, 200.0 * static_cast<double>(k)));
  }
  return regions;
}

/// All loops, the first loops of all regions first, as rings come before staircases.
Region Deal(const std::vector<Region>& regions, LoopGroups& groups) {
  Region all;
  std::vector<std::uint32_t> first;
  for (const Region& region : regions) {
    first.push_back(static_cast<std::uint32_t>(all.points.size() / 2));
    all.points.insert(all.points.end(), region.points.begin(), region.points.end());
  }
  bool is_left = true;
  for (std::size_t loop = 0; is_left; ++loop) {
    is_left = false;
    for (std::uint32_t k = 0; k < regions.size(); ++k) {
      if (loop >= regions[k].LoopCount()) continue;
      is_left = true;
      const std::uint32_t begin = regions[k].loop_offsets[loop];
      const std::uint32_t end = regions[k].loop_offsets[loop + 1];
      std::vector<std::uint32_t> points;
      for (std::uint32_t i = begin; i < end; ++i) {
        points.push_back(first[k] + regions[k].loop_points[i]);
      }
      all.AddLoop(points);
      const bool reversed = k % 2 == 1;
      if (reversed) std::reverse(points.begin(), points.end());
      groups.AddPoints(points);
      groups.EndLoop(2 * k, reversed);  // Every second group has no loop.
    }
  }
  return all;
}

TEST(LoopGroups, CoverAllRegionsForAnyNumberOfThreads) {
  const std::vector<Region> regions = AllKindsOfRegions(400);
  std::vector<std::uint32_t> expected;
  for (const unsigned threads : {1u, 2u, 7u}) {
    Arena arena(threads);
    arena.Execute([&] {
      LoopGroups groups;
      for (int frame = 0; frame < 2; ++frame) {  // The second one is warm.
        groups.Clear();
        const Region all = Deal(regions, groups);
        std::vector<std::uint32_t> triangles;
        ASSERT_TRUE(groups.Triangulate(all.points, triangles));
        if (expected.empty()) {
          ExpectCover(all, triangles);
          expected = triangles;
        }
        EXPECT_EQ(triangles, expected) << threads << " threads, frame " << frame;
      }
    });
  }
}

TEST(LoopGroups, FailsIfOneGroupOfManyIsNoRegion) {
  std::vector<Region> regions = AllKindsOfRegions(100);
  Region spoiled;
  spoiled.AddLoop(Rectangle(1e6, 0, 1e6 + 3, 3));
  spoiled.AddLoop(Rectangle(1e6 + 1, 1, 1e6 + 2, 2));  // A hole the wrong way round.
  regions.push_back(spoiled);
  LoopGroups groups;
  groups.Clear();
  const Region all = Deal(regions, groups);
  std::vector<std::uint32_t> triangles;
  EXPECT_FALSE(groups.Triangulate(all.points, triangles));
}

TEST(LoopGroups, NoLoopsMakeNoTriangles) {
  LoopGroups groups;
  groups.Clear();
  std::vector<std::uint32_t> triangles;
  EXPECT_TRUE(groups.Triangulate({}, triangles));
  EXPECT_TRUE(triangles.empty());
}

}  // namespace
}  // namespace partiemc
