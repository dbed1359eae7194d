#include "mesh/sweep_events.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "region_shapes.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::RandomEngine;
using support::Region;
using support::Uniform;

using Passage = std::tuple<double, double, std::uint32_t, std::uint32_t, std::uint32_t>;

/// The order of the contract: by height, then from left to right, then by index.
std::vector<Passage> Expected(const Region& region) {
  std::vector<Passage> passages;
  for (std::size_t loop = 0; loop < region.LoopCount(); ++loop) {
    const std::uint32_t begin = region.loop_offsets[loop];
    const std::uint32_t size = region.loop_offsets[loop + 1] - begin;
    for (std::uint32_t i = 0; i < size; ++i) {
      const auto at = [&](std::uint32_t k) { return region.loop_points[begin + k % size]; };
      const Point point = region.PointAt(at(i));
      passages.emplace_back(point.y, point.x, at(i), at(i + size - 1), at(i + 1));
    }
  }
  std::sort(passages.begin(), passages.end());
  return passages;
}

std::vector<Passage> Collected(const Region& region, SweepEvents& events) {
  EXPECT_TRUE(events.Collect(region.points, region.loop_points, region.loop_offsets));
  std::vector<Passage> passages;
  for (const SweepEvent& event : events.events()) {
    passages.emplace_back(event.point.y, event.point.x, event.index, event.previous, event.next);
  }
  // A loop may pass through a point several times; their order is not specified.
  const auto same_point = [](const Passage& a, const Passage& b) {
    return std::get<2>(a) == std::get<2>(b);
  };
  for (auto first = passages.begin(); first != passages.end();) {
    const auto last = std::find_if(
        first, passages.end(), [&](const Passage& other) { return !same_point(*first, other); });
    std::sort(first, last);
    first = last;
  }
  return passages;
}

TEST(SweepEvents, AgreeWithSort) {
  RandomEngine random(21);
  SweepEvents events;
  for (int round = 0; round < support::Tries(300); ++round) {
    SCOPED_TRACE("seed 21, round " + std::to_string(round));
    // Lattices have many points of equal height, and some points occur several times.
    Region region = support::RandomGarbage(random, 2 + round % 30, 6, 60);
    EXPECT_EQ(Collected(region, events), Expected(region));
    for (double& coordinate : region.points) coordinate += Uniform(random, -1e-9, 1e-9);
    EXPECT_EQ(Collected(region, events), Expected(region));
  }
}

TEST(SweepEvents, AreInOrderForAnyHeights) {
  RandomEngine random(22);
  SweepEvents events;
  for (const double spread : {0.0, 1e-100, 1e-15, 1.0, 1e15, 1e149}) {
    for (const double base : {0.0, 1.0, -1e149}) {
      SCOPED_TRACE(std::to_string(spread) + " about " + std::to_string(base));
      std::vector<Point> loop;
      for (int k = 0; k < 1000; ++k) {
        // Most points lie in a small part of the heights.
        const double share = Uniform(random, 0, 1);
        loop.push_back(
            {Uniform(random, 0, 1), base + spread * (k % 9 == 0 ? share : share * 0x1p-40)});
      }
      Region region;
      region.AddLoop(loop);
      EXPECT_EQ(Collected(region, events), Expected(region));
    }
  }
}

}  // namespace
}  // namespace partiemc
