// Hash grids, one per size of segments: a segment lies in the grid whose cells are just larger than
// its box, in the cell of its lower left corner, and so in one cell of one grid only, however long
// it is. It is compared with segments of its own grid and of coarser ones, of which few cells can
// hold segments that reach it.
#include "intersections.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <limits>

#include "predicates.h"

namespace partiemc {
namespace {

using Segment = TouchingPairsBuffers::Segment;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// Bits for the column and for the row of a cell, and for the level of its grid, in one key.
constexpr int kIndexBits = 29;
constexpr int kLevelBits = 5;
constexpr int kLevels = 1 << kLevelBits;
static_assert(2 * kIndexBits + kLevelBits <= 64);

// A segment is this much smaller than its cell, so that rounding of an index to the wrong side of a
// cell's border cannot put it two cells away from one that it touches. Any value well above 2^-24,
// the error of an index, will do.
constexpr double kSlack = 1.0 + 0x1p-10;

struct Box {
  double left, bottom, right, top;
};

Box BoxAround(const Segment& segment) {
  return {std::min(segment.a.x, segment.b.x), std::min(segment.a.y, segment.b.y),
          std::max(segment.a.x, segment.b.x), std::max(segment.a.y, segment.b.y)};
}

double Extent(const Box& box) { return std::max(box.right - box.left, box.top - box.bottom); }

/// Level k has square cells of side `finest` * 2^k.
class Grids {
 public:
  Grids(const Box& bounds, double mean_extent)
      : origin_{bounds.left, bounds.bottom},
        // Cells of twice the mean extent hold almost all segments of a contour in one grid and
        // still make few candidates (half of it costs a quarter more); the second bound keeps
        // indices below 2^27, the third keeps sizes above zero when all points coincide.
        finest_(std::max(
            {2 * mean_extent, Extent(bounds) * 0x1p-27, std::numeric_limits<double>::min()})) {
    for (int level = 0; level < kLevels; ++level) per_length_[level] = 1 / CellSize(level);
  }

  /// The first level whose cells hold a box of `extent`; 28 at most, by the bounds of the finest.
  int LevelFor(double extent) const {
    int level = 0;
    while (level + 1 < kLevels && CellSize(level) < kSlack * extent) ++level;
    return level;
  }

  double CellSize(int level) const { return finest_ * static_cast<double>(1u << level); }

  std::int64_t Column(double x, int level) const {
    return static_cast<std::int64_t>((x - origin_.x) * per_length_[level]);
  }
  std::int64_t Row(double y, int level) const {
    return static_cast<std::int64_t>((y - origin_.y) * per_length_[level]);
  }

  static std::uint64_t Key(int level, std::int64_t column, std::int64_t row) {
    return static_cast<std::uint64_t>(level) << (2 * kIndexBits) |
           static_cast<std::uint64_t>(row) << kIndexBits | static_cast<std::uint64_t>(column);
  }

 private:
  Point origin_;
  double finest_;
  std::array<double, kLevels> per_length_;  // By level: 1 / size of its cells.
};

// Cells of a block of this many by this many share a line of the cache: neighbours on a ring, and
// all that they are compared with, are found in few of them.
constexpr int kBlockBits = 2;
constexpr std::uint64_t kInBlock = (1u << kBlockBits) - 1;
constexpr std::size_t kBlockSlots = std::size_t{1} << (2 * kBlockBits);

/// Fibonacci hashing of the block: the high bits of the product depend on all bits of the key.
std::size_t SlotOf(std::uint64_t cell, std::size_t slot_count) {
  const std::uint64_t block = cell & ~(kInBlock << kIndexBits | kInBlock);
  const std::uint64_t in_block = (cell >> kIndexBits & kInBlock) << kBlockBits | (cell & kInBlock);
  const std::uint64_t hash = (block * 0x9e3779b97f4a7c15u) >> 32;
  return static_cast<std::size_t>(hash * kBlockSlots | in_block) & (slot_count - 1);
}

/// Whether `second`, which begins where `first` ends, lies on it for more than that point.
bool FoldsBack(const Segment& first, const Segment& second) {
  const Point& corner = first.b;
  if (first.a == corner || second.b == corner) return false;
  return SweepsBefore(first.a, corner) == SweepsBefore(second.b, corner) &&
         Orientation(first.a, corner, second.b) == 0;
}

/// Whether the pair counts, see the header.
bool TouchesMoreThanItMust(std::span<const Segment> segments, std::uint32_t i, std::uint32_t j) {
  const Segment& a = segments[i];
  const Segment& b = segments[j];
  const bool a_follows = a.previous == j;
  const bool b_follows = b.previous == i;
  if (!a_follows && !b_follows) return SegmentsTouch(a.a, a.b, b.a, b.b);
  return (a_follows && FoldsBack(b, a)) || (b_follows && FoldsBack(a, b));
}

/// Fills `segments` with ends and neighbours; returns the box around all of them.
Box CollectSegments(std::span<const double> points, std::span<const std::uint32_t> ring_offsets,
                    std::vector<Segment>& segments) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Box bounds{kInfinity, kInfinity, -kInfinity, -kInfinity};
  segments.clear();
  for (std::size_t ring = 0; ring + 1 < ring_offsets.size(); ++ring) {
    const std::uint32_t begin = ring_offsets[ring];
    const std::uint32_t end = ring_offsets[ring + 1];
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::size_t next = i + 1 == end ? begin : i + 1;
      const Point a{points[2 * std::size_t{i}], points[2 * std::size_t{i} + 1]};
      const Point b{points[2 * next], points[2 * next + 1]};
      segments.push_back({.a = a, .b = b, .previous = i == begin ? end - 1 : i - 1});
      bounds = {std::min(bounds.left, a.x), std::min(bounds.bottom, a.y),
                std::max(bounds.right, a.x), std::max(bounds.top, a.y)};
    }
  }
  return bounds;
}

/// Puts every segment into its cell; returns the set of levels that are used.
std::uint32_t FillGrids(const Grids& grids, TouchingPairsBuffers& buffers) {
  std::vector<Segment>& segments = buffers.segments;
  std::vector<std::uint32_t>& slots = buffers.slots;
  tbb::parallel_for(std::size_t{0}, segments.size(), [&](std::size_t i) {
    Segment& segment = segments[i];
    const Box box = BoxAround(segment);
    segment.level = grids.LevelFor(Extent(box));
    segment.cell = Grids::Key(segment.level, grids.Column(box.left, segment.level),
                              grids.Row(box.bottom, segment.level));
  });
  slots.assign(std::max(std::bit_ceil(2 * segments.size()), kBlockSlots), kNone);
  std::uint32_t used_levels = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    Segment& segment = segments[i];
    used_levels |= 1u << segment.level;
    std::uint32_t& slot = slots[SlotOf(segment.cell, slots.size())];
    segment.next_in_slot = slot;
    slot = static_cast<std::uint32_t>(i);
  }
  return used_levels;
}

/// Calls visit(j) for the pairs of segment i with segments j of `level` that count. What i may
/// touch has its lower left corner no farther to the right and above than the box of i, and less
/// than a cell to the left and below.
template <typename Visit>
void ForEachPairInLevel(const Grids& grids, const TouchingPairsBuffers& buffers, std::uint32_t i,
                        int level, Visit visit) {
  const std::span<const Segment> segments = buffers.segments;
  const std::span<const std::uint32_t> slots = buffers.slots;
  const Box box = BoxAround(segments[i]);
  const std::int64_t first_column = std::max<std::int64_t>(grids.Column(box.left, level) - 1, 0);
  const std::int64_t last_column = grids.Column(box.right, level);
  const std::int64_t first_row = std::max<std::int64_t>(grids.Row(box.bottom, level) - 1, 0);
  const std::int64_t last_row = grids.Row(box.top, level);
  // Of two segments of one level, the earlier one finds the pair.
  const bool finds_all = segments[i].level < level;

  for (std::int64_t row = first_row; row <= last_row; ++row) {
    for (std::int64_t column = first_column; column <= last_column; ++column) {
      const std::uint64_t cell = Grids::Key(level, column, row);
      for (std::uint32_t j = slots[SlotOf(cell, slots.size())]; j != kNone;
           j = segments[j].next_in_slot) {
        if (segments[j].cell != cell || (!finds_all && j <= i)) continue;
        if (TouchesMoreThanItMust(segments, i, j)) visit(j);
      }
    }
  }
}

/// Calls visit(j) for all pairs that segment i finds.
template <typename Visit>
void ForEachPair(const Grids& grids, const TouchingPairsBuffers& buffers, std::uint32_t used_levels,
                 std::uint32_t i, Visit visit) {
  for (int level = buffers.segments[i].level; used_levels >> level != 0; ++level) {
    if ((used_levels >> level & 1u) != 0) ForEachPairInLevel(grids, buffers, i, level, visit);
  }
}

/// Finds out which segments find pairs; returns whether any does.
bool FindPairs(const Grids& grids, TouchingPairsBuffers& buffers, std::uint32_t used_levels) {
  std::atomic<bool> has_pair = false;
  tbb::parallel_for(
      tbb::blocked_range<std::uint32_t>(0, static_cast<std::uint32_t>(buffers.segments.size())),
      [&](const tbb::blocked_range<std::uint32_t>& range) {
        for (std::uint32_t i = range.begin(); i < range.end(); ++i) {
          ForEachPair(grids, buffers, used_levels, i, [&](std::uint32_t) {
            buffers.segments[i].finds_pair = true;
            has_pair.store(true, std::memory_order_relaxed);
          });
        }
      });
  return has_pair;
}

}  // namespace

std::size_t CountTouchingPairs(std::span<const double> points,
                               std::span<const std::uint32_t> ring_offsets,
                               TouchingPairsBuffers& buffers) {
  const std::vector<Segment>& segments = buffers.segments;
  const Box bounds = CollectSegments(points, ring_offsets, buffers.segments);
  buffers.pairs.clear();
  if (segments.empty()) return 0;
  double extents = 0;
  for (const Segment& segment : segments) extents += Extent(BoxAround(segment));
  const Grids grids(bounds, extents / static_cast<double>(segments.size()));

  const std::uint32_t used_levels = FillGrids(grids, buffers);
  // Nearly all frames have no pair. Pairs are listed in the order of the segments, whatever the
  // number of threads.
  if (!FindPairs(grids, buffers, used_levels)) return 0;
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < segments.size(); ++i) {
    if (!segments[i].finds_pair) continue;
    ForEachPair(grids, buffers, used_levels, i, [&](std::uint32_t j) {
      ++count;
      if (buffers.pairs.size() < segments.size()) buffers.pairs.emplace_back(i, j);
      buffers.example_first = std::min(i, j);
      buffers.example_second = std::max(i, j);
    });
  }
  return count;
}

}  // namespace partiemc
