// Method. Segments are grouped into short runs along their rings. If all segments of a run point to
// the right, for example, the run does not meet itself. It does not meet the next run either if all
// segments of that run point to the right, too. This excludes nearly all pairs of neighbours.
//
// Successive runs of a ring form a block. A hierarchical grid finds blocks that are near each
// other. Each block is stored in one cell: the cell at its lower left corner, in the grid whose
// cells are just larger than its box. A block is compared with blocks of the same grid and of
// coarser grids. In each of these grids, only a few cells can hold blocks that touch it. Comparing
// all runs of two blocks costs less than finding the neighbours of each run in a grid.
#include "vertices/intersections.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>

#include "base/bits.h"
#include "base/parallel.h"
#include "base/predicates.h"
#include "vertices/hierarchical_grid.h"

namespace partiemc {
namespace {

using Run = TouchingPairsBuffers::Run;
using Block = TouchingPairsBuffers::Block;

// Most segments of a run. With longer runs more boxes would overlap.
constexpr std::uint32_t kRunLength = 8;

// Most runs of a block.
constexpr std::uint32_t kBlockRuns = 8;

// Bits of Run::directions.
constexpr unsigned kRightward = 1, kLeftward = 2, kUpward = 4, kDownward = 8;

struct RingSegment {
  Point a, b;
};

/// Whether two successive segments overlap in more than their common point.
bool FoldsBack(const RingSegment& first, const RingSegment& second) {
  const Point& corner = first.b;
  if (first.a == corner || second.b == corner) return false;
  return SweepsBefore(first.a, corner) == SweepsBefore(second.b, corner) &&
         Orientation(first.a, corner, second.b) == 0;
}

struct Search {
  std::span<const double> points;
  TouchingPairsBuffers& buffers;
  std::uint32_t used_levels = 0;

  std::span<Run> RunsOf(const Block& block) const {
    return std::span(buffers.runs).subspan(block.first_run, block.last_run - block.first_run);
  }
  RingSegment SegmentAt(const Run& run, std::uint32_t i) const {
    return {PointAt(points, i), PointAt(points, i + 1 == run.ring_end ? run.ring_begin : i + 1)};
  }
};

std::uint32_t Previous(const Run& run, std::uint32_t i) {
  return (i == run.ring_begin ? run.ring_end : i) - 1;
}

void Measure(const Search& s, Run& run) {
  Box box;
  box.Add(PointAt(s.points, run.first));
  unsigned directions = kRightward | kLeftward | kUpward | kDownward;
  for (std::uint32_t i = run.first; i < run.last; ++i) {
    const auto [a, b] = s.SegmentAt(run, i);
    box.Add(b);
    directions &= (a.x < b.x ? kRightward : 0u) | (a.x > b.x ? kLeftward : 0u) |
                  (a.y < b.y ? kUpward : 0u) | (a.y > b.y ? kDownward : 0u);
  }
  run.box = box;
  run.directions = static_cast<std::uint8_t>(directions);
}

void Measure(const Search& s, Block& block) {
  Box box;
  for (Run& run : s.RunsOf(block)) {
    Measure(s, run);
    box.Add({run.box.left, run.box.bottom});
    box.Add({run.box.right, run.box.top});
  }
  block.box = box;
}

void CollectBlocks(Search& s, std::span<const std::uint32_t> ring_offsets) {
  std::vector<Run>& runs = s.buffers.runs;
  std::vector<Block>& blocks = s.buffers.blocks;
  runs.clear();
  blocks.clear();
  for (std::size_t ring = 0; ring + 1 < ring_offsets.size(); ++ring) {
    const std::uint32_t begin = ring_offsets[ring];
    const std::uint32_t end = ring_offsets[ring + 1];
    const std::size_t first_run = runs.size();
    for (std::uint32_t first = begin; first < end; first += kRunLength) {
      if ((runs.size() - first_run) % kBlockRuns == 0) {
        blocks.push_back({.first_run = static_cast<std::uint32_t>(runs.size())});
      }
      runs.push_back({.first = first,
                      .last = std::min(first + kRunLength, end),
                      .ring_begin = begin,
                      .ring_end = end});
      blocks.back().last_run = static_cast<std::uint32_t>(runs.size());
    }
  }
  ParallelFor(blocks.size(), [&](std::size_t k) { Measure(s, blocks[k]); });
}

HierarchicalGrid MakeGrid(const Search& s) {
  Box bounds;
  double extents = 0;
  for (const Block& block : s.buffers.blocks) {
    bounds.Add({block.box.left, block.box.bottom});
    bounds.Add({block.box.right, block.box.top});
    extents += block.box.Extent();
  }
  return HierarchicalGrid(bounds, extents / static_cast<double>(s.buffers.blocks.size()));
}

void FillGrid(Search& s, const HierarchicalGrid& grid) {
  std::vector<Block>& blocks = s.buffers.blocks;
  std::vector<std::uint32_t>& slots = s.buffers.slots;
  slots.assign(std::bit_ceil(2 * blocks.size()), kNoIndex);
  s.used_levels = 0;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Block& block = blocks[k];
    const int level = grid.LevelFor(block.box.Extent());
    s.used_levels |= 1u << level;
    block.level = static_cast<std::uint8_t>(level);
    block.cell = HierarchicalGrid::Key(level, grid.Column(block.box.left, level),
                                       grid.Row(block.box.bottom, level));
    std::uint32_t& slot = slots[SlotOf(block.cell, slots.size())];
    block.next_in_slot = slot;
    slot = static_cast<std::uint32_t>(k);
  }
}

/// Whether two segments count as a pair: successive segments if they overlap, others if they touch.
bool Touches(const Search& s, const Run& of_i, std::uint32_t i, const Run& of_j, std::uint32_t j) {
  const RingSegment a = s.SegmentAt(of_i, i);
  const RingSegment b = s.SegmentAt(of_j, j);
  const bool a_follows = Previous(of_i, i) == j;
  const bool b_follows = Previous(of_j, j) == i;
  if (!a_follows && !b_follows) return SegmentsTouch(a.a, a.b, b.a, b.b);
  return (a_follows && FoldsBack(b, a)) || (b_follows && FoldsBack(a, b));
}

template <typename Visit>
void ForEachPairWithin(const Search& s, const Run& run, Visit visit) {
  if (run.directions != 0) return;
  for (std::uint32_t i = run.first; i < run.last; ++i) {
    for (std::uint32_t j = i + 1; j < run.last; ++j) {
      if (Touches(s, run, i, run, j)) visit(i, j);
    }
  }
}

template <typename Visit>
void ForEachPairBetween(const Search& s, const Run& first, const Run& second, Visit visit) {
  if (!BoxesTouch(first.box, second.box)) return;
  const bool follows = Previous(second, second.first) == first.last - 1 ||
                       Previous(first, first.first) == second.last - 1;
  if (follows && (first.directions & second.directions) != 0) return;
  for (std::uint32_t i = first.first; i < first.last; ++i) {
    const RingSegment segment = s.SegmentAt(first, i);
    Box box;
    box.Add(segment.a);
    box.Add(segment.b);
    if (!BoxesTouch(box, second.box)) continue;
    for (std::uint32_t j = second.first; j < second.last; ++j) {
      if (Touches(s, first, i, second, j)) visit(i, j);
    }
  }
}

template <typename Visit>
void ForEachPairWithin(const Search& s, const Block& block, Visit visit) {
  const std::span<const Run> runs = s.RunsOf(block);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    ForEachPairWithin(s, runs[k], visit);
    for (const Run& later : runs.subspan(k + 1)) ForEachPairBetween(s, runs[k], later, visit);
  }
}

template <typename Visit>
void ForEachPairBetween(const Search& s, const Block& first, const Block& second, Visit visit) {
  if (!BoxesTouch(first.box, second.box)) return;
  for (const Run& run : s.RunsOf(first)) {
    if (!BoxesTouch(run.box, second.box)) continue;
    for (const Run& other : s.RunsOf(second)) ForEachPairBetween(s, run, other, visit);
  }
}

/// Calls visit(i, j) for the touching pairs within a block, with later blocks of its grid, and with
/// blocks of coarser grids. A touching block has its lower left corner in a cell that meets this
/// block's box, one column to the left of these cells, or one row below.
template <typename Visit>
void ForEachPair(const Search& s, const HierarchicalGrid& grid, std::uint32_t index, Visit visit) {
  const std::span<const Block> blocks = s.buffers.blocks;
  const std::span<const std::uint32_t> slots = s.buffers.slots;
  const Block& block = blocks[index];
  ForEachPairWithin(s, block, visit);
  for (int level = block.level; s.used_levels >> level != 0; ++level) {
    if ((s.used_levels >> level & 1u) == 0) continue;
    const std::int64_t first_column =
        std::max<std::int64_t>(grid.Column(block.box.left, level) - 1, 0);
    const std::int64_t last_column = grid.Column(block.box.right, level);
    const std::int64_t first_row = std::max<std::int64_t>(grid.Row(block.box.bottom, level) - 1, 0);
    const std::int64_t last_row = grid.Row(block.box.top, level);
    // If two blocks have the same level, the earlier one finds their pairs.
    const bool finds_all = block.level < level;
    for (std::int64_t row = first_row; row <= last_row; ++row) {
      for (std::int64_t column = first_column; column <= last_column; ++column) {
        const std::uint64_t cell = HierarchicalGrid::Key(level, column, row);
        for (std::uint32_t other = slots[SlotOf(cell, slots.size())]; other != kNoIndex;
             other = blocks[other].next_in_slot) {
          if (blocks[other].cell != cell || (!finds_all && other <= index)) continue;
          ForEachPairBetween(s, block, blocks[other], visit);
        }
      }
    }
  }
}

/// Sets Block::finds_pair: whether ForEachPair finds a pair. Only one of the two blocks of a pair
/// finds the pair. Returns whether any block finds one.
bool FindPairs(Search& s, const HierarchicalGrid& grid) {
  std::atomic<bool> has_pair = false;
  ParallelFor(static_cast<std::uint32_t>(s.buffers.blocks.size()), [&](std::uint32_t index) {
    Block& block = s.buffers.blocks[index];
    block.finds_pair = false;
    ForEachPair(s, grid, index, [&](std::uint32_t, std::uint32_t) { block.finds_pair = true; });
    if (block.finds_pair) has_pair.store(true, std::memory_order_relaxed);
  });
  return has_pair;
}

}  // namespace

std::size_t CountTouchingPairs(std::span<const double> points,
                               std::span<const std::uint32_t> ring_offsets,
                               TouchingPairsBuffers& buffers) {
  Search s{points, buffers};
  CollectBlocks(s, ring_offsets);
  buffers.pairs.clear();
  if (buffers.blocks.empty()) return 0;
  const HierarchicalGrid grid = MakeGrid(s);
  FillGrid(s, grid);
  // Nearly all frames have no pair, so a parallel search looks for any first. The pairs are then
  // listed block by block, so that their order does not depend on the threads.
  if (!FindPairs(s, grid)) return 0;
  std::size_t count = 0;
  const std::size_t max_pairs = points.size() / 2;
  for (std::uint32_t block = 0; block < buffers.blocks.size(); ++block) {
    if (!buffers.blocks[block].finds_pair) continue;
    ForEachPair(s, grid, block, [&](std::uint32_t i, std::uint32_t j) {
      ++count;
      if (buffers.pairs.size() < max_pairs) buffers.pairs.emplace_back(i, j);
    });
  }
  return count;
}

}  // namespace partiemc
