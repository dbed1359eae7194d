// Active cells in the order of the lattice's rows.
#pragma once

#include <cstdint>
#include <vector>

#include "crossings.h"
#include "lattice.h"

namespace partiemc {

/// Calls visit(index) for every active cell, by row of the lattice, then by column. `next_cell` is
/// scratch, by tile. Cost: linear in tiles and cells.
template <typename Visit>
void ForEachCellByRow(const TileDirectory& directory, const Crossings& crossings,
                      std::vector<std::uint32_t>& next_cell, Visit visit) {
  // Cells are sorted by tile, then row; a row of the lattice runs through a row of tiles.
  const std::size_t tiles = crossings.tiles.size();
  next_cell.resize(tiles);
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    next_cell[tile] = crossings.tiles[tile].first_cell;
  }
  for (std::size_t first = 0, last = 0; first < tiles; first = last) {
    while (last < tiles && directory[last].y == directory[first].y) ++last;
    for (int j = 0; j < kTileSize; ++j) {
      for (std::size_t tile = first; tile < last; ++tile) {
        std::uint32_t& cell = next_cell[tile];
        // The tile's last cell may be the last of this row, or there may be none.
        while (cell < crossings.cells.size() && crossings.cells[cell].j == j &&
               crossings.cells[cell].tile == tile) {
          visit(cell++);
        }
      }
    }
  }
}

}  // namespace partiemc
