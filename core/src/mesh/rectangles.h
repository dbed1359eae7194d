// Covers the interior cells with rectangles (paper, section 3.8).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bins/lattice.h"

namespace partiemc {

/// A rectangle of `width` x `height` cells.
struct CellRectangle {
  TilePlace corner;  ///< Its lower left cell.
  int width, height;
};

/// The corner nodes, counter-clockwise from the lower left one.
/// Requires: all cells of the rectangle are interior, so that every tile along its sides exists.
std::array<TilePlace, 4> CornersOf(const TileDirectory& directory, const CellRectangle& rectangle);

/// Number of cells; `cells` has one bit for each cell, by tile.
std::uint64_t CountCells(std::span<const BitRows> cells);

/// Scratch of MergeCells.
struct MergeScratch {
  std::vector<BitRows> free;                                  // By tile: cells in no rectangle yet.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> span;  // A row of cells: tiles and bits.
};

/// Covers the interior cells with disjoint rectangles. Scans the cells row by row; each free cell
/// grows along its row, then upward by whole rows. Appends the rectangles in this order. `interior`
/// has one bit for each cell, by tile.
/// Cost: linear in cells, as section 3.7 of the paper claims.
void MergeCells(const TileDirectory& directory, std::span<const BitRows> interior,
                MergeScratch& scratch, std::vector<CellRectangle>& rectangles);

}  // namespace partiemc
