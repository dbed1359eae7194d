#include "identities/run_overlaps.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <set>

#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using Shared = std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint64_t>;

// Disjoint runs of some rings, in order.
std::vector<NodeRun> RandomRuns(support::Random& random, std::uint32_t rings) {
  std::vector<NodeRun> runs;
  for (std::int32_t row = -5; row < 5; ++row) {
    std::int32_t column = -10;
    while (column < 20) {
      const auto first = column + static_cast<std::int32_t>(random.Below(5));
      const auto last = first + static_cast<std::int32_t>(random.Below(6));
      runs.push_back({row, first, last, static_cast<std::uint32_t>(random.Below(rings))});
      column = last + 1;
    }
  }
  return runs;
}

Shared ByNodes(const std::vector<NodeRun>& a_runs, const std::vector<CellShift<2>>& shifts,
               const std::vector<NodeRun>& b_runs) {
  Shared shared;
  for (const NodeRun& a : a_runs) {
    for (const NodeRun& b : b_runs) {
      for (std::int64_t column = a.first; column <= a.last; ++column) {
        const std::int64_t moved = column + shifts[a.ring][0];
        if (a.row + shifts[a.ring][1] == b.row && moved >= b.first && moved <= b.last) {
          ++shared[{a.ring, b.ring}];
        }
      }
    }
  }
  return shared;
}

Shared Found(const std::vector<NodeRun>& a_runs, const std::vector<NodeRun>& b_runs) {
  std::vector<SharedNodes> pairs;
  std::vector<std::uint32_t> newest;
  FindSharedNodes<NodeRun>(a_runs, b_runs, newest, pairs);
  Shared shared;
  for (const SharedNodes& pair : pairs) {
    EXPECT_TRUE(shared.emplace(std::pair(pair.a, pair.b), pair.nodes).second);
  }
  return shared;
}

TEST(RunOverlaps, AgreeWithNodesAlsoIfMovedRingsOverlap) {
  for (std::uint64_t seed = 1; seed <= support::Tries(100u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    support::Random random(seed);
    constexpr std::uint32_t kRings = 6;
    const std::vector<NodeRun> before = RandomRuns(random, kRings);
    const std::vector<NodeRun> now = RandomRuns(random, kRings);
    std::vector<CellShift<2>> shifts(kRings);
    EXPECT_EQ(Found(before, now), ByNodes(before, shifts, now));
    for (CellShift<2>& shift : shifts) {
      shift = {static_cast<std::int64_t>(random.Below(21)) - 10,
               static_cast<std::int64_t>(random.Below(7)) - 3};
    }
    std::vector<NodeRun> moved;
    MoveRuns<NodeRun>(before, shifts, moved);
    EXPECT_EQ(Found(moved, now), ByNodes(before, shifts, now));
  }
}

TEST(RunOverlaps, DropRunsBeyondTheLattice) {
  constexpr std::int32_t kLargest = std::numeric_limits<std::int32_t>::max();
  const std::vector<NodeRun> runs = {{0, 0, 3, 0}, {kLargest, 5, 6, 0}, {kLargest, 7, 8, 1}};
  std::vector<NodeRun> moved;
  MoveRuns<NodeRun>(runs, std::vector<CellShift<2>>{{0, 1}, {kLargest - 8, 0}}, moved);
  EXPECT_EQ(moved, (std::vector<NodeRun>{{1, 0, 3, 0}, {kLargest, kLargest - 1, kLargest, 1}}));
}

TEST(RunOverlaps, LimitTheCostOfOverlappingRings) {
  // A thousand long runs over a thousand short ones would have a million overlaps.
  std::vector<NodeRun> heap, row;
  for (std::uint32_t k = 0; k < 1000; ++k) {
    heap.push_back({0, 0, 10000, k});
    row.push_back({0, static_cast<std::int32_t>(10 * k), static_cast<std::int32_t>(10 * k + 4), k});
  }
  EXPECT_TRUE(Found(heap, row).empty());
  heap.resize(10);
  EXPECT_EQ(Found(heap, row).size(), 10u * 1000u);
}

}  // namespace
}  // namespace partiemc
