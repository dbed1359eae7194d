// World coordinates -> tiles and positions in them, many at a time.
#pragma once

#include <array>
#include <cstdint>

#include "scale.h"

namespace partiemc {

/// Positions are rounded to this fraction of a cell: a tile with the widest margin spans less than
/// 2^7 cells, so that 24 bits of mantissa hold any position in it exactly.
inline constexpr int kFractionBits = 17;

/// How far a particle reaches, in cells rounded up to the positions' resolution.
struct Reach {
  double units_per_world;  ///< Units are 2^-17 cells.
  float kernel;            ///< The kernel radius, at most a tile.
  float tiles;             ///< Tiles exist as far as this, less than two tiles.
};

/// `tile_margin`: how much farther than kernels tiles exist, in cells.
Reach ReachOf(const Scale& scale, double tile_margin);

/// Whether a coordinate is at most 2^30 cells from the origin: beyond that a double no longer
/// resolves a millionth of a cell.
bool IsNearOrigin(double units);

inline constexpr int kBlockParticles = 256;

/// The coordinates of up to kBlockParticles particles, x and y in turn.
struct CoordinateBlock {
  template <typename Value>
  using PerCoordinate = std::array<Value, 2 * kBlockParticles>;

  PerCoordinate<double> units;           ///< From the world's origin.
  PerCoordinate<std::int32_t> tile;      ///< Column or row of tiles.
  PerCoordinate<std::uint32_t> sides;    ///< Bit 0: the kernel reaches below the tile; 1: above it.
  PerCoordinate<std::uint32_t> reached;  ///< Bit d + 2: the tile d from this one must exist.
};

/// Sets everything of the first `count` coordinates from their units, and their `positions` in
/// their tiles, in cells. Returns false, without doing so, if one is too far from the origin.
bool FindTiles(int count, const Reach& reach, CoordinateBlock& block, float* positions);

}  // namespace partiemc
