// Counts the lattice nodes that pieces of two frames share, with or without moving the pieces
// first.
//
// For runs of lattice nodes in the plane and in space (state/pieces.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <tuple>
#include <vector>

#include "base/bits.h"
#include "periodic/frame_box.h"
#include "periodic/run_periods.h"
#include "state/pieces.h"

namespace partiemc {

/// A displacement in whole cells, by axis.
template <std::size_t kDimensions>
using CellShift = std::array<std::int64_t, kDimensions>;

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

/// The order of runs: by row, then first column, then piece.
template <typename Run>
bool ComesBefore(const Run& a, const Run& b) {
  return std::tuple(RowOf(a), a.first, PieceOf(a)) < std::tuple(RowOf(b), b.first, PieceOf(b));
}

/// Writes `runs`, moved by the shifts of their pieces, to `moved`, sorted. Moved runs may overlap.
/// Drops runs whose coordinates exceed 32 bits.
template <typename Run, typename Shift>
void MoveRuns(std::span<const Run> runs, const std::vector<Shift>& shift_of_piece,
              std::vector<Run>& moved) {
  moved.clear();
  for (Run run : runs) {
    const Shift& shift = shift_of_piece[PieceOf(run)];
    bool fits = true;
    const auto move = [&](std::int32_t& node, std::int64_t by) {
      const std::int64_t to = node + by;
      fits = fits && to >= std::numeric_limits<std::int32_t>::min() &&
             to <= std::numeric_limits<std::int32_t>::max();
      node = static_cast<std::int32_t>(to);
    };
    move(run.first, shift[0]);
    move(run.last, shift[0]);
    const auto row = RowAxesOf(run);
    for (std::size_t k = 0; k < row.size(); ++k) move(*row[k], shift[k + 1]);
    if (fits) moved.push_back(run);
  }
  // Usually the runs are still sorted, because all of them move alike or not at all.
  if (std::is_sorted(moved.begin(), moved.end(), ComesBefore<Run>)) return;
  std::sort(moved.begin(), moved.end(), ComesBefore<Run>);
}

/// Writes `runs`, wrapped into the periodic box, to `wrapped`, sorted. Runs are split at faces.
/// Runs of inner pieces may then overlap other runs.
template <typename Run>
void WrapRuns(std::span<const Run> runs, const LatticePeriods& periods, std::vector<Run>& wrapped) {
  wrapped.clear();
  for (Run run : runs) {
    const auto row = RowAxesOf(run);
    for (std::size_t k = 0; k < row.size(); ++k) {
      *row[k] = static_cast<std::int32_t>(*row[k] - WrapOf(periods.cells[k + 1], *row[k]));
    }
    ForEachWrapped(periods.cells[0], run.first, run.last,
                   [&](std::int32_t first, std::int32_t last) {
                     Run& part = wrapped.emplace_back(run);
                     part.first = first;
                     part.last = last;
                   });
  }
  std::sort(wrapped.begin(), wrapped.end(), ComesBefore<Run>);
}

/// Sets `moved` to `history` after the motion of its box: each run moves with its middle node, each
/// sample to the nearest node. Moved runs may overlap.
template <typename History>
void MoveWithBox(const BoxMotion& motion, const History& history, History& moved) {
  moved = history;
  for (auto& run : moved.runs) {
    const auto row = RowAxesOf(run);
    for (std::size_t k = 0; k < row.size(); ++k) *row[k] = motion.NodeAt(k + 1, *row[k]);
    motion.MoveRun(0, run.first, run.last);
  }
  std::ranges::sort(moved.runs, [](const auto& a, const auto& b) { return ComesBefore(a, b); });
  for (auto& sample : moved.samples) {
    const auto axes = AxesOf(sample);
    for (std::size_t k = 0; k < axes.size(); ++k) *axes[k] = motion.NodeAt(k, *axes[k]);
  }
}

/// Writes to `shared` the pairs of pieces that share nodes: each pair once, sorted by `a`, the
/// piece in `a_runs`, then `b`. `newest` is scratch. Requires: both sets of runs are sorted by row,
/// then column.
///
/// Runs of `b_runs` should not overlap each other: each such overlap costs a comparison. Moved
/// pieces may overlap without limit. If there are more than kMaxOverlapsPerRun overlaps per run of
/// both sets, `shared` is therefore left empty.
/// Cost: linear in runs, pieces and overlaps, n log n in pairs of pieces.
template <typename Run>
void FindSharedNodes(std::span<const Run> a_runs, std::span<const Run> b_runs,
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
