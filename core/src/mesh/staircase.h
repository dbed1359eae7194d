// The staircase outline of the interior cells, which are given as rows of bits by tile.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/lattice.h"

namespace partiemc {

/// Closed loops along lattice edges with interior cells on the left: outlines counter-clockwise,
/// voids clockwise. Only the corners are listed. Where two interior cells touch at a node only, the
/// loop turns so that it stays with its cell.
struct Staircases {
  std::vector<TilePlace> corners;
  std::vector<std::uint32_t> offsets;  ///< Loop k has corners [offsets[k], offsets[k + 1]).
  std::uint64_t pinches = 0;           ///< Nodes at which two interior cells touch, and only there.
  std::vector<BitRows> visited;        ///< Scratch: bottom edges that a loop has passed.
};

/// Cost: linear in tiles and in the length of the loops.
void TraceStaircases(const TileDirectory& directory, std::span<const BitRows> interior,
                     Staircases& staircases);

/// Euler characteristic of the cells that the loops bound, taken as open sets: outlines less voids,
/// and less pinches, which join cells. Cost: linear in corners.
std::int64_t EulerCharacteristic(const TileDirectory& directory, const Staircases& staircases);

}  // namespace partiemc
