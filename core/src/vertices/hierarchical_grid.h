// A hierarchical grid for boxes: grids with cells of different sizes, the levels. Gives the level,
// cell and slot of a box. The caller keeps the hash table, one for all levels (intersections.cc).
// It stores each box once, in the cell of the lower left corner, at the level with the smallest
// cells that are larger than the box.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/bits.h"
#include "base/box.h"

namespace partiemc {

// Bits of a key: one column, one row and one level.
inline constexpr int kGridIndexBits = 29;
inline constexpr int kGridLevelBits = 5;
inline constexpr int kGridLevels = 1 << kGridLevelBits;
static_assert(2 * kGridIndexBits + kGridLevelBits <= 64);

// Smallest ratio of the size of a cell to the extent of a box in it. Two boxes that touch then lie
// at most one cell apart, even if an index is rounded to the wrong side of a border. Any value well
// above 1 + 2^-24, the error of an index, is sufficient.
inline constexpr double kGridSlack = 1.0 + 0x1p-10;

/// Level k has square cells of side `finest` * 2^k.
class HierarchicalGrid {
 public:
  /// `bounds` contains all boxes; `mean_extent` is their mean extent.
  HierarchicalGrid(const Box& bounds, double mean_extent)
      : origin_{bounds.left, bounds.bottom},
        // With cells of twice the mean extent, nearly all boxes are in the finest grid, and a cell
        // has few candidates. The second term keeps indices at or below 2^27, the third keeps sizes
        // above 0 if all points coincide.
        finest_(std::max(
            {2 * mean_extent, bounds.Extent() * 0x1p-27, std::numeric_limits<double>::min()})) {
    for (int level = 0; level < kGridLevels; ++level) per_length_[level] = 1 / CellSize(level);
  }

  /// The first level whose cells can hold a box of `extent`; at most 28, because the finest cells
  /// have at least 2^-27 of the extent of `bounds`.
  int LevelFor(double extent) const {
    int level = 0;
    while (level + 1 < kGridLevels && CellSize(level) < kGridSlack * extent) ++level;
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
    return static_cast<std::uint64_t>(level) << (2 * kGridIndexBits) |
           static_cast<std::uint64_t>(row) << kGridIndexBits | static_cast<std::uint64_t>(column);
  }

 private:
  Point origin_;
  double finest_;
  std::array<double, kGridLevels> per_length_;  // By level: 1 / size of its cells.
};

/// The slot of a key in a table of `slot_count` slots, a power of two.
inline std::size_t SlotOf(std::uint64_t cell, std::size_t slot_count) {
  return TableHash(cell) & (slot_count - 1);
}

}  // namespace partiemc
