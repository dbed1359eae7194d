// Segments are taken in short runs along their rings. A run of which all segments go to the right,
// say, does not meet itself, nor the run after it if that goes to the right, too: on contours this
// leaves hardly any pairs of neighbours, by comparisons of coordinates alone.
//
// A short ring whose box touches no other ring's is searched by itself, each run against all of the
// later ones. Other runs are found in a hierarchical grid: a run lies in the grid
// whose cells are just larger than its box, in the cell of its lower left corner, and so in one
// cell of one grid only, however long it is. It is compared with runs of its own grid and of
// coarser ones, of which few cells can hold runs that reach it.
#include "vertices/intersections.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>

#include "base/parallel.h"
#include "base/predicates.h"
#include "vertices/hierarchical_grid.h"

namespace partiemc {
namespace {

using Run = TouchingPairsBuffers::Run;

// Segments of a run. Longer ones have larger boxes, of which more overlap.
constexpr std::uint32_t kRunLength = 8;

// Runs of a short ring. Comparing a run with all others of so many costs less than to find those
// near it.
constexpr std::uint32_t kShortRingRuns = 64;

// Directions that all segments of a run may have.
constexpr unsigned kRightward = 1, kLeftward = 2, kUpward = 4, kDownward = 8;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

struct Segment {
  Point a, b;
};

/// Whether `second`, which begins where `first` ends, lies on it for more than that point.
bool FoldsBack(const Segment& first, const Segment& second) {
  const Point& corner = first.b;
  if (first.a == corner || second.b == corner) return false;
  return SweepsBefore(first.a, corner) == SweepsBefore(second.b, corner) &&
         Orientation(first.a, corner, second.b) == 0;
}

/// All of the work on one input.
class PairSearch {
 public:
  PairSearch(std::span<const double> points, TouchingPairsBuffers& buffers)
      : points_(points), buffers_(buffers) {}

  void CollectRuns(std::span<const std::uint32_t> ring_offsets);
  void SettleRuns(std::span<const std::uint8_t> is_moved);
  /// Requires: runs were collected, and settled if this is not the first search for them.
  std::size_t Count(std::span<const std::uint32_t> ring_offsets);

 private:
  Segment SegmentAt(const Run& run, std::uint32_t i) const {
    return {PointAt(points_, i), PointAt(points_, i + 1 == run.ring_end ? run.ring_begin : i + 1)};
  }
  static std::uint32_t Previous(const Run& run, std::uint32_t i) {
    return (i == run.ring_begin ? run.ring_end : i) - 1;
  }

  void MeasureRuns();
  void Measure(Run& run) const;
  void FindLoneRuns(std::span<const std::uint32_t> ring_offsets);
  HierarchicalGrid MakeGrid() const;
  void FillGrid(const HierarchicalGrid& grid);

  bool Touches(const Run& of_i, std::uint32_t i, const Run& of_j, std::uint32_t j) const;
  template <typename Visit>
  void ForEachPairWithin(const Run& run, Visit visit) const;
  template <typename Visit>
  void ForEachPairBetween(const Run& first, const Run& second, Visit visit) const;
  template <typename Visit>
  void ForEachPairInRing(std::uint32_t run, Visit visit) const;
  template <typename Visit>
  void ForEachPair(const HierarchicalGrid& grid, std::uint32_t run, Visit visit) const;
  bool FindPairs(const HierarchicalGrid& grid);

  std::span<const double> points_;
  TouchingPairsBuffers& buffers_;
  std::uint32_t used_levels_ = 0;
};

void PairSearch::CollectRuns(std::span<const std::uint32_t> ring_offsets) {
  std::vector<Run>& runs = buffers_.runs;
  runs.clear();
  for (std::size_t ring = 0; ring + 1 < ring_offsets.size(); ++ring) {
    const std::uint32_t begin = ring_offsets[ring];
    const std::uint32_t end = ring_offsets[ring + 1];
    for (std::uint32_t first = begin; first < end; first += kRunLength) {
      runs.push_back({.first = first,
                      .last = std::min(first + kRunLength, end),
                      .ring_begin = begin,
                      .ring_end = end});
    }
  }
  MeasureRuns();
}

/// Finds out which rings are as they were, and measures the runs of the others.
void PairSearch::SettleRuns(std::span<const std::uint8_t> is_moved) {
  std::uint32_t ring = kNone;  // Where it begins.
  bool is_settled = false;
  for (Run& run : buffers_.runs) {
    if (run.ring_begin != ring) {
      ring = run.ring_begin;
      const auto points = is_moved.subspan(ring, run.ring_end - ring);
      is_settled = std::ranges::all_of(points, [](std::uint8_t moved) { return moved == 0; });
    }
    run.is_settled = is_settled;
  }
  MeasureRuns();
}

void PairSearch::MeasureRuns() {
  ParallelFor(buffers_.runs.size(), [&](std::size_t k) {
    Run& run = buffers_.runs[k];
    if (!run.is_settled) Measure(run);
  });
}

void PairSearch::Measure(Run& run) const {
  Box box;
  box.Add(PointAt(points_, run.first));
  unsigned directions = kRightward | kLeftward | kUpward | kDownward;
  for (std::uint32_t i = run.first; i < run.last; ++i) {
    const auto [a, b] = SegmentAt(run, i);
    box.Add(b);
    directions &= (a.x < b.x ? kRightward : 0u) | (a.x > b.x ? kLeftward : 0u) |
                  (a.y < b.y ? kUpward : 0u) | (a.y > b.y ? kDownward : 0u);
  }
  run.left = box.left;
  run.bottom = box.bottom;
  run.right = box.right;
  run.top = box.top;
  run.directions = static_cast<std::uint8_t>(directions);
}

/// Runs from the one that begins at segment `first` to the end of its ring.
std::uint32_t RunsUpTo(std::uint32_t ring_end, std::uint32_t first) {
  return (ring_end - first + kRunLength - 1) / kRunLength;
}

void PairSearch::FindLoneRuns(std::span<const std::uint32_t> ring_offsets) {
  std::vector<Run>& runs = buffers_.runs;
  std::vector<Box>& boxes = buffers_.ring_boxes;
  boxes.clear();
  std::size_t next = 0;
  for (std::size_t ring = 0; ring + 1 < ring_offsets.size(); ++ring) {
    Box& box = boxes.emplace_back();
    for (; next < runs.size() && runs[next].first < ring_offsets[ring + 1]; ++next) {
      box.Add({runs[next].left, runs[next].bottom});
      box.Add({runs[next].right, runs[next].top});
    }
  }
  FindBoxesApart(boxes, buffers_.boxes_apart, buffers_.is_apart);
  next = 0;
  for (std::size_t ring = 0; ring + 1 < ring_offsets.size(); ++ring) {
    const std::uint32_t count = RunsUpTo(ring_offsets[ring + 1], ring_offsets[ring]);
    const bool is_alone = buffers_.is_apart[ring] != 0 && count <= kShortRingRuns;
    for (const std::size_t end = next + count; next < end; ++next) {
      Run& run = runs[next];
      // Which run of a pair finds it depends on whether they are alone.
      run.is_settled = run.is_settled && run.is_alone;
      run.is_alone = is_alone;
    }
  }
}

HierarchicalGrid PairSearch::MakeGrid() const {
  Box bounds;
  double extents = 0;
  std::size_t count = 0;
  for (const Run& run : buffers_.runs) {
    if (run.is_alone) continue;
    ++count;
    bounds.Add({run.left, run.bottom});
    bounds.Add({run.right, run.top});
    extents += Extent(run);
  }
  return HierarchicalGrid(bounds, extents / static_cast<double>(std::max(count, std::size_t{1})));
}

/// Puts every run into its cell.
void PairSearch::FillGrid(const HierarchicalGrid& grid) {
  std::vector<Run>& runs = buffers_.runs;
  std::vector<std::uint32_t>& slots = buffers_.slots;
  const auto count = static_cast<std::size_t>(
      std::ranges::count_if(runs, [](const Run& run) { return !run.is_alone; }));
  slots.assign(std::max(std::bit_ceil(2 * count), kBlockSlots), kNone);
  used_levels_ = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    Run& run = runs[k];
    if (run.is_alone) continue;
    const int level = grid.LevelFor(Extent(run));
    used_levels_ |= 1u << level;
    run.level = static_cast<std::uint8_t>(level);
    run.cell =
        HierarchicalGrid::Key(level, grid.Column(run.left, level), grid.Row(run.bottom, level));
    std::uint32_t& slot = slots[SlotOf(run.cell, slots.size())];
    run.next_in_slot = slot;
    slot = static_cast<std::uint32_t>(k);
  }
}

/// Whether a pair of segments counts, see the header.
bool PairSearch::Touches(const Run& of_i, std::uint32_t i, const Run& of_j, std::uint32_t j) const {
  const Segment a = SegmentAt(of_i, i);
  const Segment b = SegmentAt(of_j, j);
  const bool a_follows = Previous(of_i, i) == j;
  const bool b_follows = Previous(of_j, j) == i;
  if (!a_follows && !b_follows) return SegmentsTouch(a.a, a.b, b.a, b.b);
  return (a_follows && FoldsBack(b, a)) || (b_follows && FoldsBack(a, b));
}

template <typename Visit>
void PairSearch::ForEachPairWithin(const Run& run, Visit visit) const {
  if (run.directions != 0) return;
  for (std::uint32_t i = run.first; i < run.last; ++i) {
    for (std::uint32_t j = i + 1; j < run.last; ++j) {
      if (Touches(run, i, run, j)) visit(i, j);
    }
  }
}

template <typename Visit>
void PairSearch::ForEachPairBetween(const Run& first, const Run& second, Visit visit) const {
  if (!BoxesTouch(first, second)) return;
  const bool follows = Previous(second, second.first) == first.last - 1 ||
                       Previous(first, first.first) == second.last - 1;
  if (follows && (first.directions & second.directions) != 0) return;
  for (std::uint32_t i = first.first; i < first.last; ++i) {
    const Segment segment = SegmentAt(first, i);
    Box box;
    box.Add(segment.a);
    box.Add(segment.b);
    if (!BoxesTouch(box, second)) continue;
    for (std::uint32_t j = second.first; j < second.last; ++j) {
      if (Touches(first, i, second, j)) visit(i, j);
    }
  }
}

template <typename Visit>
void PairSearch::ForEachPairInRing(std::uint32_t index, Visit visit) const {
  const std::span<const Run> runs = buffers_.runs;
  const Run& run = runs[index];
  const std::uint32_t end = index + RunsUpTo(run.ring_end, run.first);
  for (std::uint32_t other = index + 1; other < end; ++other) {
    ForEachPairBetween(run, runs[other], visit);
  }
}

/// Calls visit(i, j) for all pairs that count, of segments of a run and of later ones. What a run
/// may touch has its lower left corner no farther to the right and above than its box, and less
/// than a cell to the left and below.
template <typename Visit>
void PairSearch::ForEachPair(const HierarchicalGrid& grid, std::uint32_t index, Visit visit) const {
  const std::span<const Run> runs = buffers_.runs;
  const std::span<const std::uint32_t> slots = buffers_.slots;
  const Run& run = runs[index];
  ForEachPairWithin(run, visit);
  if (run.is_alone) {
    ForEachPairInRing(index, visit);
    return;
  }
  for (int level = run.level; used_levels_ >> level != 0; ++level) {
    if ((used_levels_ >> level & 1u) == 0) continue;
    const std::int64_t first_column = std::max<std::int64_t>(grid.Column(run.left, level) - 1, 0);
    const std::int64_t last_column = grid.Column(run.right, level);
    const std::int64_t first_row = std::max<std::int64_t>(grid.Row(run.bottom, level) - 1, 0);
    const std::int64_t last_row = grid.Row(run.top, level);
    // Of two runs of one level, the earlier one finds the pairs.
    const bool finds_all = run.level < level;
    for (std::int64_t row = first_row; row <= last_row; ++row) {
      for (std::int64_t column = first_column; column <= last_column; ++column) {
        const std::uint64_t cell = HierarchicalGrid::Key(level, column, row);
        for (std::uint32_t other = slots[SlotOf(cell, slots.size())]; other != kNone;
             other = runs[other].next_in_slot) {
          if (runs[other].cell != cell || (!finds_all && other <= index)) continue;
          ForEachPairBetween(run, runs[other], visit);
        }
      }
    }
  }
}

/// Finds out which runs find pairs; returns whether any does.
bool PairSearch::FindPairs(const HierarchicalGrid& grid) {
  std::atomic<bool> has_pair = false;
  ParallelFor(static_cast<std::uint32_t>(buffers_.runs.size()), [&](std::uint32_t index) {
    Run& run = buffers_.runs[index];
    // Where all that it could meet is as it was, it still finds none.
    if (run.is_settled && run.is_alone && !run.finds_pair) return;
    bool finds_pair = false;
    ForEachPair(grid, index, [&](std::uint32_t, std::uint32_t) { finds_pair = true; });
    run.finds_pair = finds_pair;
    if (finds_pair) has_pair.store(true, std::memory_order_relaxed);
  });
  return has_pair;
}

std::size_t PairSearch::Count(std::span<const std::uint32_t> ring_offsets) {
  buffers_.pairs.clear();
  if (buffers_.runs.empty()) return 0;
  FindLoneRuns(ring_offsets);
  const HierarchicalGrid grid = MakeGrid();
  FillGrid(grid);
  // Nearly all frames have no pair. Pairs are listed in the order of the runs, whatever the number
  // of threads.
  if (!FindPairs(grid)) return 0;
  std::size_t count = 0;
  const std::size_t max_pairs = points_.size() / 2;
  for (std::uint32_t run = 0; run < buffers_.runs.size(); ++run) {
    if (!buffers_.runs[run].finds_pair) continue;
    ForEachPair(grid, run, [&](std::uint32_t i, std::uint32_t j) {
      ++count;
      if (buffers_.pairs.size() < max_pairs) buffers_.pairs.emplace_back(i, j);
      buffers_.example_first = std::min(i, j);
      buffers_.example_second = std::max(i, j);
    });
  }
  return count;
}

}  // namespace

std::size_t CountTouchingPairs(std::span<const double> points,
                               std::span<const std::uint32_t> ring_offsets,
                               TouchingPairsBuffers& buffers) {
  PairSearch search(points, buffers);
  search.CollectRuns(ring_offsets);
  return search.Count(ring_offsets);
}

std::size_t CountTouchingPairsAgain(std::span<const double> points,
                                    std::span<const std::uint32_t> ring_offsets,
                                    std::span<const std::uint8_t> is_moved,
                                    TouchingPairsBuffers& buffers) {
  PairSearch search(points, buffers);
  search.SettleRuns(is_moved);
  return search.Count(ring_offsets);
}

}  // namespace partiemc
