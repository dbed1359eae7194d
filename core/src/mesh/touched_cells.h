// Removes the cells that the rings touch from the interior cells.
#pragma once

#include <cstdint>
#include <span>

#include "bins/lattice.h"

namespace partiemc {

/// Clears the bits of all cells that a ring crosses, or passed over while its vertices moved from
/// `roots` to `points`, and of some cells nearby. The remaining cells lie inside the rings and do
/// not touch them. `interior` has one bit for each cell, by tile. `points` and `roots` are
/// interleaved, in world units, and have one position for each point of the rings. Deterministic.
/// Parallel over stretches of points. Cost: linear in the points.
void ExcludeTouchedCells(const TileDirectory& directory, std::span<const double> points,
                         std::span<const std::uint32_t> offsets, std::span<const double> roots,
                         double cell_size, std::span<BitRows> interior);

}  // namespace partiemc
