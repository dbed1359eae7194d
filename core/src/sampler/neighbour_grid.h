// Divides tiles into buckets for neighbour queries.
#pragma once

#include <algorithm>
#include <cstdint>

#include "bins/lattice.h"
#include "bins/quantise.h"

namespace partiemc {

/// Divides each tile along one axis into buckets of a power of two of cells.
class GridAxis {
 public:
  /// Buckets of `width` cells, rounded down to a power of two; at least one cell, at most a tile.
  explicit GridAxis(double width = 0) {
    while (shift_ < kTileShift && (2 << shift_) <= width) ++shift_;
  }

  /// Buckets per tile.
  int size() const { return kTileSize >> shift_; }

  /// The bucket of a coordinate in cells relative to a tile, clamped to this tile and its two
  /// neighbours. Buckets count from the start of the neighbour before the tile.
  int Along(double coordinate) const {
    const int cell = static_cast<int>(coordinate + kTileSize);
    return std::clamp(cell, 0, 3 * kTileSize - 1) >> shift_;
  }
  /// The tile, 0 to 2, of a bucket that Along returned.
  int TileOf(int along) const { return along >> (kTileShift - shift_); }

  /// The bucket of a coordinate in its own tile, 0 <= coordinate < 32.
  std::uint32_t InTile(float coordinate) const {
    return static_cast<std::uint32_t>(static_cast<int>(coordinate)) >> shift_;
  }

 private:
  int shift_ = 0;
};

/// Buckets are much wider than high. Queries therefore read few offsets, but more particles outside
/// of their disc. Vectors skip these particles at less cost than more offsets would have.
struct NeighbourGrid {
  /// Resolution of positions, in cells.
  static constexpr double kStep = 1.0 / (1 << kFractionBits);

  NeighbourGrid() = default;
  /// For queries within `radius` cells, at most the side of a tile.
  explicit NeighbourGrid(double radius) : columns(radius * 8 / 3), rows(radius / 4) {}

  GridAxis columns, rows;
};

}  // namespace partiemc
