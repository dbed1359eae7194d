// The cover of the interior cells, which are given as rows of bits by tile, by rectangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bins/lattice.h"

namespace partiemc {

/// `width` x `height` cells from the cell `corner` on, to the right and upwards.
struct CellRectangle {
  TilePlace corner;
  int width, height;
};

/// Its corners, counter-clockwise from the lower left one. Requires: all of its cells are interior,
/// so that there are tiles all along its sides.
std::array<TilePlace, 4> CornersOf(const TileDirectory& directory, const CellRectangle& rectangle);

/// The number of cells in rows of bits.
std::uint64_t CountCells(std::span<const BitRows> cells);

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
