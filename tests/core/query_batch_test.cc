#include "sampler/query_batch.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

struct GroupPoint {
  double x = 0, y = 0;
};

using Group = PointGroup<GroupPoint>;

// Points of segments of a ring, none to two of each, by runs of a tile.
struct Points {
  explicit Points(support::Random& random) : count_of(1 + random.Below(200)) {
    std::uint32_t tile = 0;
    for (std::size_t& count : count_of) {
      count = random.Below(3);
      if (random.Chance(0.2)) tile = static_cast<std::uint32_t>(random.Below(4));
      for (std::size_t k = 0; k < count; ++k) tiles.push_back(tile);
    }
  }

  std::vector<std::size_t> count_of;  // By segment.
  std::vector<std::uint32_t> tiles;   // By point.
};

// The groups of segments [first, last), and how many were handed on at a time.
std::vector<Group> GroupsOf(const Points& points, std::size_t first, std::size_t last,
                            std::vector<std::size_t>& at_once) {
  std::vector<Group> all;
  auto groups = CollectPoints<GroupPoint>([&](std::span<const Group> some) {
    all.insert(all.end(), some.begin(), some.end());
    at_once.push_back(some.size());
  });
  std::size_t point = 0;
  for (std::size_t segment = 0; segment < last; ++segment) {
    if (segment >= first && BeginsGroup(segment)) groups.Part();
    for (std::size_t k = 0; k < points.count_of[segment]; ++k, ++point) {
      if (segment < first) continue;
      groups.Add(point, points.tiles[point], {static_cast<double>(point), 0.0});
    }
  }
  groups.Finish();
  return all;
}

TEST(QueryBatch, HoldEachPointOnceInOrderWithNeighboursOfItsTileOnly) {
  for (std::uint64_t seed = 0; seed < support::Tries(200u); ++seed) {
    support::Random random(seed);
    const Points points(random);
    std::vector<std::size_t> segment_of;
    for (std::size_t segment = 0; segment < points.count_of.size(); ++segment) {
      segment_of.insert(segment_of.end(), points.count_of[segment], segment);
    }
    std::vector<std::size_t> at_once;
    std::size_t next = 0;
    const Group* before = nullptr;
    const std::vector<Group> all = GroupsOf(points, 0, points.count_of.size(), at_once);
    for (const Group& group : all) {
      ASSERT_GT(group.count, 0u);
      ASSERT_LE(group.count, kPointsAtOnce);
      const std::size_t begin = BeginOfGroup(segment_of[next]);
      // Nothing that could have joined the group before begins one of its own.
      if (before != nullptr) {
        EXPECT_FALSE(before->tile == group.tile && BeginOfGroup(segment_of[next - 1]) == begin);
      }
      for (std::size_t k = 0; k < group.count; ++k, ++next) {
        EXPECT_EQ(group.vertices[k], next);
        EXPECT_EQ(group.points[k].x, static_cast<double>(next));
        EXPECT_EQ(group.tile, points.tiles[next]);
        EXPECT_EQ(BeginOfGroup(segment_of[next]), begin);
      }
      before = &group;
    }
    EXPECT_EQ(next, points.tiles.size());
    for (std::size_t k = 0; k + 1 < at_once.size(); ++k) EXPECT_EQ(at_once[k], kQueriesAtOnce);
  }
}

// Tasks begin anywhere in a ring.
TEST(QueryBatch, AreTheSameWhereverCollectingBegins) {
  for (std::uint64_t seed = 0; seed < support::Tries(200u); ++seed) {
    support::Random random(seed);
    const Points points(random);
    const std::size_t last = points.count_of.size();
    const std::size_t cut = BeginOfGroup(random.Below(last));
    std::vector<std::size_t> at_once;
    const std::vector<Group> all = GroupsOf(points, 0, last, at_once);
    std::vector<Group> parts = GroupsOf(points, 0, cut, at_once);
    for (const Group& group : GroupsOf(points, cut, last, at_once)) parts.push_back(group);
    ASSERT_EQ(parts.size(), all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      EXPECT_EQ(parts[k].count, all[k].count);
      EXPECT_EQ(parts[k].tile, all[k].tile);
      EXPECT_EQ(parts[k].vertices[0], all[k].vertices[0]);
    }
  }
}

}  // namespace
}  // namespace partiemc
