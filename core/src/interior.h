// The interior cells as shapes: their staircase outline and their cover by rectangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "crossings.h"
#include "lattice.h"

namespace partiemc {

/// Takes the cells that the rings run through, or that they ran over on their way from `roots`,
/// out of the interior: what is left lies inside of the rings and does not touch them. `points` and
/// `roots` are interleaved, in world units, one of each per point of the rings.
/// Cost: linear in the points.
void ExcludeTouchedCells(const TileDirectory& directory, std::span<const double> points,
                         std::span<const std::uint32_t> offsets, std::span<const double> roots,
                         double cell_size, std::vector<TileBits>& tiles);

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
void TraceStaircases(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                     Staircases& staircases);

/// `width` x `height` cells from the cell `corner` on, to the right and upwards.
struct CellRectangle {
  TilePlace corner;
  int width, height;
};

/// Warm buffers of MergeCells.
struct MergeScratch {
  std::vector<BitRows> free;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> span;  // Tile and bits of a row of cells.
};

/// Covers the interior cells with disjoint rectangles (paper, section 3.8): rows are scanned, each
/// free cell grows along its row, then by whole rows. Appends to `rectangles` in that order.
/// Cost: linear in cells, as section 3.7 claims.
void MergeCells(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                MergeScratch& scratch, std::vector<CellRectangle>& rectangles);

}  // namespace partiemc
