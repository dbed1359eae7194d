// Traces the staircase outline of the interior cells.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/lattice.h"
#include "mesh/node_vertices.h"

namespace partiemc {

/// Closed loops along lattice edges with the interior cells on the left: outlines
/// counter-clockwise, voids clockwise. Only corners and requested nodes are listed. At a pinch, a
/// node at which two interior cells touch diagonally, each loop stays with its cell.
struct Staircases {
  std::vector<TilePlace> corners;      ///< Corners, and requested nodes on straight parts.
  std::uint64_t straight_nodes = 0;    ///< Number of requested nodes on straight parts.
  std::vector<std::uint32_t> offsets;  ///< Loop k has corners [offsets[k], offsets[k + 1]).
  std::uint64_t pinches = 0;
  std::vector<BitRows> visited;  ///< Scratch: bottom edges that a loop has passed.
};

/// Traces all loops. `interior` has one bit for each cell, by tile. `nodes`: the requested nodes,
/// or null. Cost: linear in tiles and in the length of the loops.
void TraceStaircases(const TileDirectory& directory, std::span<const BitRows> interior,
                     const NodeVertices* nodes, Staircases& staircases);

/// Euler characteristic of the region inside the loops: outlines - voids - pinches, since a pinch
/// joins two cells. Cost: linear in corners.
std::int64_t EulerCharacteristic(const TileDirectory& directory, const Staircases& staircases);

}  // namespace partiemc
