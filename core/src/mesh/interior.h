// The interior cells, in rows of bits by tile, as shapes: their staircase outline and their cover
// by rectangles.
#pragma once

#include <array>
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

/// `width` x `height` cells from the cell `corner` on, to the right and upwards.
struct CellRectangle {
  TilePlace corner;
  int width, height;
};

/// Its corners, counter-clockwise from the lower left one. Requires: all of its cells are interior,
/// so that there are tiles all along its sides.
std::array<TilePlace, 4> CornersOf(const TileDirectory& directory, const CellRectangle& rectangle);

/// Warm buffers of MergeCells.
struct MergeScratch {
  std::vector<BitRows> free;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> span;  // Tile and bits of a row of cells.
};

/// Covers the interior cells with disjoint rectangles (paper, section 3.8): rows are scanned, each
/// free cell grows along its row, then by whole rows. Appends to `rectangles` in that order.
/// Cost: linear in cells, as section 3.7 claims.
void MergeCells(const TileDirectory& directory, std::span<const BitRows> interior,
                MergeScratch& scratch, std::vector<CellRectangle>& rectangles);

}  // namespace partiemc
