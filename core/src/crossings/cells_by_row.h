// Active cells in the order of the lattice's rows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bins/lattice.h"
#include "crossings/crossings.h"

namespace partiemc {

/// Lists active cells by row of the lattice, then by column. Keeps its memory warm.
class CellsByRow {
 public:
  /// The cells for which is_wanted(ActiveCell) holds, by index; valid until the next call.
  /// Cost: linear in tiles and cells, without a branch on what a cell is.
  template <typename IsWanted>
  std::span<const std::uint32_t> List(const TileDirectory& directory, const Crossings& crossings,
                                      IsWanted is_wanted);

 private:
  std::vector<std::uint32_t> cells_;
  std::vector<std::uint32_t> wanted_;  // Of one row of tiles, by tile.
};

template <typename IsWanted>
std::span<const std::uint32_t> CellsByRow::List(const TileDirectory& directory,
                                                const Crossings& crossings, IsWanted is_wanted) {
  const std::span<const ActiveCell> cells = crossings.cells;
  cells_.resize(cells.size());
  wanted_.resize(cells.size());
  std::uint32_t listed = 0;
  std::uint32_t first = 0;
  // Cells are sorted by tile, tiles by row: those of a row of tiles are dealt to its rows of cells.
  for (std::size_t tile = 0; tile < directory.size();) {
    const std::int32_t y = directory[tile].y;
    while (tile < directory.size() && directory[tile].y == y) ++tile;
    const std::uint32_t last = tile < directory.size() ? crossings.tiles[tile].first_cell
                                                       : static_cast<std::uint32_t>(cells.size());
    std::array<std::uint32_t, kTileSize> next{};  // By row of cells: how many, then where they go.
    std::uint32_t count = 0;
    for (std::uint32_t cell = first; cell < last; ++cell) {
      const std::uint32_t wanted = is_wanted(cells[cell]) ? 1 : 0;
      next[cells[cell].j] += wanted;
      wanted_[count] = cell;
      count += wanted;
    }
    for (std::uint32_t& start : next) {
      const std::uint32_t in_row = start;
      start = listed;
      listed += in_row;
    }
    for (std::uint32_t k = 0; k < count; ++k) cells_[next[cells[wanted_[k]].j]++] = wanted_[k];
    first = last;
  }
  return std::span(cells_).first(listed);
}

}  // namespace partiemc
