#include "identities/run_overlaps.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <tuple>

#include "base/bits.h"

namespace partiemc {
namespace {

constexpr std::size_t kMaxOverlapsPerRun = 16;

bool Fits(std::int64_t value) {
  return value >= std::numeric_limits<std::int32_t>::min() &&
         value <= std::numeric_limits<std::int32_t>::max();
}

bool ComesBefore(const NodeRun& a, const NodeRun& b) {
  return std::tie(a.row, a.first, a.ring) < std::tie(b.row, b.first, b.ring);
}

// Sorts the pairs and adds up the nodes of equal pairs.
void SumByPair(std::vector<SharedNodes>& shared) {
  std::sort(shared.begin(), shared.end(), [](const SharedNodes& x, const SharedNodes& y) {
    return std::tie(x.a, x.b) < std::tie(y.a, y.b);
  });
  std::size_t kept = 0;
  for (const SharedNodes& pair : shared) {
    if (kept > 0 && shared[kept - 1].a == pair.a && shared[kept - 1].b == pair.b) {
      shared[kept - 1].nodes += pair.nodes;
    } else {
      shared[kept++] = pair;
    }
  }
  shared.resize(kept);
}

}  // namespace

void MoveRuns(std::span<const NodeRun> runs, std::span<const CellShift> shift_of_ring,
              std::vector<NodeRun>& moved) {
  moved.clear();
  for (const NodeRun& run : runs) {
    const CellShift& shift = shift_of_ring[run.ring];
    const std::int64_t row = run.row + shift.rows;
    const std::int64_t first = run.first + shift.columns;
    const std::int64_t last = run.last + shift.columns;
    if (!Fits(row) || !Fits(first) || !Fits(last)) continue;
    moved.push_back({static_cast<std::int32_t>(row), static_cast<std::int32_t>(first),
                     static_cast<std::int32_t>(last), run.ring});
  }
  // Usually the runs are still sorted, because all of them move alike or not at all.
  if (std::is_sorted(moved.begin(), moved.end(), ComesBefore)) return;
  std::sort(moved.begin(), moved.end(), ComesBefore);
}

void FindSharedNodes(std::span<const NodeRun> a_runs, std::span<const NodeRun> b_runs,
                     std::vector<std::uint32_t>& newest, std::vector<SharedNodes>& shared) {
  shared.clear();
  newest.clear();
  const std::size_t max_overlaps = kMaxOverlapsPerRun * (a_runs.size() + b_runs.size());
  std::size_t overlaps = 0;
  std::size_t begin = 0;
  for (const NodeRun& a : a_runs) {
    // A run of b that ends before this run of a begins also ends before all later runs of a.
    while (begin < b_runs.size() &&
           std::tie(b_runs[begin].row, b_runs[begin].last) < std::tie(a.row, a.first)) {
      ++begin;
    }
    for (std::size_t k = begin;
         k < b_runs.size() && b_runs[k].row == a.row && b_runs[k].first <= a.last; ++k) {
      if (overlaps++ == max_overlaps) {
        shared.clear();
        return;
      }
      const NodeRun& b = b_runs[k];
      const std::uint64_t nodes = NodeCount(std::max(a.first, b.first), std::min(a.last, b.last));
      // Usually a ring overlaps the same ring as in the previous row, so only its newest pair is
      // tried. Pairs that are added repeatedly are summed at the end.
      if (a.ring >= newest.size()) newest.resize(a.ring + 1, kNoIndex);
      std::uint32_t& pair = newest[a.ring];
      if (pair != kNoIndex && shared[pair].b == b.ring) {
        shared[pair].nodes += nodes;
      } else {
        pair = static_cast<std::uint32_t>(shared.size());
        shared.push_back({a.ring, b.ring, nodes});
      }
    }
  }
  SumByPair(shared);
}

}  // namespace partiemc
