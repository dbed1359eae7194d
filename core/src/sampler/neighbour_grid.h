// The buckets into which the particles of a tile are sorted.
#pragma once

#include <algorithm>
#include <cstdint>

#include "bins/lattice.h"
#include "bins/quantise.h"

namespace partiemc {

/// How a tile is divided along one of its axes, and its neighbours alike: into powers of two of
/// cells, so that each bucket lies in one tile.
class GridAxis {
 public:
  /// As wide as `width` cells, rounded down, but at least one.
  explicit GridAxis(double width = 0) {
    while (shift_ < kTileShift && (2 << shift_) <= width) ++shift_;
  }

  /// Buckets along a tile.
  int size() const { return kTileSize >> shift_; }

  /// Of a coordinate in cells relative to the tile: counted from the first of the neighbour before
  /// the tile to the last of the one behind it.
  int Along(double coordinate) const {
    const int cell = static_cast<int>(coordinate + kTileSize);
    return std::clamp(cell, 0, 3 * kTileSize - 1) >> shift_;
  }
  /// The place of such a bucket's tile, 0 to 2.
  int TileOf(int along) const { return along >> (kTileShift - shift_); }

  /// Of a particle's coordinate in its tile, 0 <= coordinate < 32.
  std::uint32_t InTile(float coordinate) const {
    return static_cast<std::uint32_t>(static_cast<int>(coordinate)) >> shift_;
  }

 private:
  int shift_ = 0;
};

/// Rows of buckets, much wider than high: what a row holds beyond the disc of a query is cheaper to
/// pass over in vectors than more offsets are to look up and to write.
struct NeighbourGrid {
  /// Positions are multiples of it.
  static constexpr double kStep = 1.0 / (1 << kFractionBits);

  NeighbourGrid() = default;
  /// For queries within `radius` cells of points of the tile, at most a tile.
  explicit NeighbourGrid(double radius) : columns(radius * 8 / 3), rows(radius / 4) {}

  GridAxis columns, rows;
};

}  // namespace partiemc
