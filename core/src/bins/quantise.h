// World coordinates -> tiles and positions in them, many at a time, in the vectors of the processor
// at hand.
#pragma once

#include <cstdint>
#include <span>

#include "frame/scale.h"

namespace partiemc {

/// Positions are rounded to this fraction of a cell: a tile with the widest margin spans less than
/// 2^7 cells, so that 24 bits of mantissa hold any position in it exactly.
inline constexpr int kFractionBits = 17;

/// Units are 2^-17 cells.
double UnitsPerWorld(const Scale& scale);

/// A length in cells, rounded up to the positions' resolution.
float RoundedUp(double cells);

/// Whether a coordinate is at most 2^30 cells from the origin: beyond that a double no longer
/// resolves a millionth of a cell.
bool IsNearOrigin(double units);

/// Of each coordinate its column or row of tiles, and its position in that tile in cells. Returns
/// whether all are near the origin; where one is not, or is no number, its results mean nothing.
/// Requires: `tiles` and `positions` have as many elements as `coordinates`.
/// Every processor gives the same: each step is exact, or rounded once to a whole unit.
bool FindTiles(std::span<const float> coordinates, double units_per_world, std::int32_t* tiles,
               float* positions);
bool FindTiles(std::span<const double> coordinates, double units_per_world, std::int32_t* tiles,
               float* positions);

}  // namespace partiemc
