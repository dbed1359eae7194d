// The buckets into which particles around a tile are sorted.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "near_entries.h"

namespace partiemc {

/// Rows of square buckets over a tile and a margin around it; what is farther out counts to the
/// outermost ones.
class BucketGrid {
 public:
  BucketGrid() = default;
  /// For queries within `radius` cells of points of the tile.
  explicit BucketGrid(double radius);

  /// Along either axis, of a coordinate in cells relative to the tile.
  int Along(double coordinate) const {
    // Truncation rounds down: nothing is farther from its tile than the margin.
    const int index = static_cast<int>((coordinate + margin_) * per_cell_);
    return std::clamp(index, 0, columns_ - 1);
  }

  /// In a row, and rows.
  int columns() const { return columns_; }
  std::uint32_t count() const { return static_cast<std::uint32_t>(columns_ * columns_); }

  /// Whether no bucket has particles of two tiles.
  bool KeepsTilesApart() const;

  /// By entry: its bucket, row after row. Vectors may write a few more.
  using Buckets = std::array<std::int32_t, NearEntries::kCapacity + NearEntries::kPadding>;
  void Find(const NearEntries& near, Buckets& buckets) const;

 private:
  double margin_ = 0;  // Cells that buckets extend beyond the tile on each side.
  double per_cell_ = 1;
  int columns_ = 0;
};

}  // namespace partiemc
