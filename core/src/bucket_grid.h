// The buckets into which particles around a tile are sorted.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "cell_mask.h"
#include "coordinate_block.h"
#include "near_entries.h"

namespace partiemc {

/// Buckets [column, column + columns) of the rows [row, row + rows) of a grid.
struct BucketBox {
  int column = 0, row = 0;
  int columns = 0, rows = 0;

  std::uint32_t count() const { return static_cast<std::uint32_t>(columns * rows); }
};

/// Rows of square buckets over a tile and a margin around it; what is farther out counts to the
/// outermost ones.
class BucketGrid {
 public:
  /// Positions are multiples of it.
  static constexpr double kStep = 1.0 / (1 << kFractionBits);

  BucketGrid() = default;
  /// For queries within `radius` cells of points of the tile.
  explicit BucketGrid(double radius);

  /// Along either axis, of a coordinate in cells relative to the tile.
  int Along(double coordinate) const {
    // Truncation rounds down: nothing is farther from its tile than the margin.
    const int index = static_cast<int>((coordinate + margin_) * per_cell_);
    return std::clamp(index, 0, columns_ - 1);
  }

  /// All buckets.
  BucketBox All() const { return {0, 0, columns_, columns_}; }
  /// The smallest box with all that lies in cells of a mask, which has some.
  BucketBox Around(const CellMask& mask) const;

  /// By entry: its bucket, row after row of a box that has them all. Vectors may write a few more.
  using Buckets = std::array<std::int32_t, NearEntries::kCapacity + NearEntries::kPadding>;
  void Find(const NearEntries& near, const BucketBox& box, Buckets& buckets) const;

 private:
  double margin_ = 0;  // Cells that buckets extend beyond the tile on each side.
  double per_cell_ = 1;
  int columns_ = 0;
};

}  // namespace partiemc
