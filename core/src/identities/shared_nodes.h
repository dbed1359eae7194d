// Sweeps over the runs of two frames and sums the nodes that their pieces share.
//
// For runs of lattice nodes in the plane and in space. RowOf(run) is the row of a run, PieceOf(run)
// its ring or shell, and `first` and `last` are its end nodes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "base/bits.h"

namespace partiemc {

/// Number of nodes that piece `a` of one set of runs shares with piece `b` of another set.
struct SharedNodes {
  std::uint32_t a = 0, b = 0;
  std::uint64_t nodes = 0;
};

inline std::uint64_t NodeCount(std::int32_t first, std::int32_t last) {
  return static_cast<std::uint64_t>(std::int64_t{last} - first + 1);
}

// Bounds the cost if many runs overlap each other.
inline constexpr std::size_t kMaxOverlapsPerRun = 16;

// Sorts the pairs and adds up the nodes of equal pairs.
inline void SumByPair(std::vector<SharedNodes>& shared) {
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

/// FindSharedNodes (run_overlaps.h) for any type of runs.
template <typename Run>
void SweepSharedNodes(std::span<const Run> a_runs, std::span<const Run> b_runs,
                      std::vector<std::uint32_t>& newest, std::vector<SharedNodes>& shared) {
  shared.clear();
  newest.clear();
  const std::size_t max_overlaps = kMaxOverlapsPerRun * (a_runs.size() + b_runs.size());
  std::size_t overlaps = 0;
  std::size_t begin = 0;
  for (const Run& a : a_runs) {
    // A run of b that ends before this run of a begins also ends before all later runs of a.
    while (begin < b_runs.size() &&
           (RowOf(b_runs[begin]) < RowOf(a) ||
            (RowOf(b_runs[begin]) == RowOf(a) && b_runs[begin].last < a.first))) {
      ++begin;
    }
    for (std::size_t k = begin;
         k < b_runs.size() && RowOf(b_runs[k]) == RowOf(a) && b_runs[k].first <= a.last; ++k) {
      if (overlaps++ == max_overlaps) {
        shared.clear();
        return;
      }
      const Run& b = b_runs[k];
      if (b.last < a.first) continue;  // Follows a longer run: runs of b may overlap.
      const std::uint64_t nodes = NodeCount(std::max(a.first, b.first), std::min(a.last, b.last));
      // Usually a ring overlaps the same ring as in the previous row, so only its newest pair is
      // tried. Pairs that are added repeatedly are summed at the end.
      if (PieceOf(a) >= newest.size()) newest.resize(PieceOf(a) + 1, kNoIndex);
      std::uint32_t& pair = newest[PieceOf(a)];
      if (pair != kNoIndex && shared[pair].b == PieceOf(b)) {
        shared[pair].nodes += nodes;
      } else {
        pair = static_cast<std::uint32_t>(shared.size());
        shared.push_back({PieceOf(a), PieceOf(b), nodes});
      }
    }
  }
  SumByPair(shared);
}

}  // namespace partiemc
