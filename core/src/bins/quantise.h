// Converts world coordinates to tiles and positions in them, in vectors.
#pragma once

#include <cstdint>
#include <span>

#include "frame/scale.h"

namespace partiemc {

/// Positions are rounded to 2^-17 cells. A tile with the widest margin spans less than 2^7 cells,
/// so the 24-bit mantissa of a float holds every position exactly.
inline constexpr int kFractionBits = 17;

/// Units (2^-17 cells) per world unit.
double UnitsPerWorld(const Scale& scale);

/// A length in cells, rounded up to whole units.
float RoundedUp(double cells);

/// Whether a coordinate in units (2^-17 cells) is at most 2^30 cells from the origin. Farther away,
/// the step between two doubles exceeds 2e-7 cells.
bool IsNearOrigin(double units);

/// For each coordinate: its tile column or row, and its position in that tile in cells. Returns
/// whether all are near the origin; otherwise (or for NaN) the results are meaningless. Requires:
/// `tiles` and `positions` have the size of `coordinates`. Each step is exact or rounds once to a
/// whole unit, so all processors give the same bits.
bool FindTiles(std::span<const float> coordinates, double units_per_world, std::int32_t* tiles,
               float* positions);
bool FindTiles(std::span<const double> coordinates, double units_per_world, std::int32_t* tiles,
               float* positions);

}  // namespace partiemc
