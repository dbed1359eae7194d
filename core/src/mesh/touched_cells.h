// Which interior cells the rings leave alone.
#pragma once

#include <cstdint>
#include <span>

#include "bins/lattice.h"

namespace partiemc {

/// Takes the cells that the rings run through, or that they ran over on their way from `roots`,
/// out of the interior: what is left lies inside of the rings and does not touch them. `interior`
/// has its rows of bits by tile; `points` and `roots` are interleaved, in world units, one of each
/// per point of the rings. In parallel over stretches of points. Cost: linear in the points.
void ExcludeTouchedCells(const TileDirectory& directory, std::span<const double> points,
                         std::span<const std::uint32_t> offsets, std::span<const double> roots,
                         double cell_size, std::span<BitRows> interior);

}  // namespace partiemc
