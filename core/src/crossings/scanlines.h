// Visits active cells and crossed horizontal edges by row of the lattice. The order of the edges in
// a row shows the nesting of rings, so rings need not be filled.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bins/lattice.h"
#include "crossings/crossings.h"
#include "partiemc/result.h"

namespace partiemc {

/// Lists active cells by row of the lattice, then column. Reuses its memory.
class CellsByRow {
 public:
  /// Returns the indices of the cells for which is_wanted(ActiveCell) is true; valid until the next
  /// call. Cost: linear in tiles and cells, branch-free.
  template <typename IsWanted>
  std::span<const std::uint32_t> List(const TileDirectory& directory, const Crossings& crossings,
                                      IsWanted is_wanted);

 private:
  std::vector<std::uint32_t> cells_;
  std::vector<std::uint32_t> wanted_;  // Selected cells of one row of tiles.
};

template <typename IsWanted>
std::span<const std::uint32_t> CellsByRow::List(const TileDirectory& directory,
                                                const Crossings& crossings, IsWanted is_wanted) {
  const std::span<const ActiveCell> cells = crossings.cells;
  cells_.resize(cells.size());
  wanted_.resize(cells.size());
  std::uint32_t listed = 0;
  std::uint32_t first = 0;
  // Cells are sorted by tile, and tiles by row, so a counting sort in each row of tiles is enough.
  for (std::size_t tile = 0; tile < directory.size();) {
    const std::int32_t y = directory[tile].y;
    while (tile < directory.size() && directory[tile].y == y) ++tile;
    const std::uint32_t last = tile < directory.size() ? crossings.tiles[tile].first_cell
                                                       : static_cast<std::uint32_t>(cells.size());
    // By row of cells: the count, then the next index.
    std::array<std::uint32_t, kTileSize> next{};
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

/// A horizontal lattice edge that a ring crosses. Along a row of the lattice, each edge begins or
/// ends an inside stretch; the two kinds alternate.
struct CrossedEdge {
  std::int32_t row = 0, column = 0;  ///< Its left node, in cells from the world's origin.
  std::uint32_t ring = kNoRing;
  bool begins_inside = false;  ///< Its right node is inside; otherwise its left one is.
};

/// Visits the horizontal lattice edges that rings cross, row by row. Reuses its memory.
class Scanlines {
 public:
  /// Sets the rings: ring k has segments [offsets[k], offsets[k + 1]). Segments outside all rings
  /// are not visited.
  void SetRings(const Crossings& crossings, std::span<const std::uint32_t> segments,
                std::span<const std::uint32_t> offsets);

  /// Calls visit(CrossedEdge) for each horizontal edge that a ring crosses, by row, then column.
  /// Cost: linear in segments and tiles.
  template <typename Visit>
  void ForEachEdge(const TileDirectory& directory, const Crossings& crossings, Visit visit);

 private:
  std::vector<std::uint32_t> ring_of_segment_;
  CellsByRow cells_;
};

inline void Scanlines::SetRings(const Crossings& crossings, std::span<const std::uint32_t> segments,
                                std::span<const std::uint32_t> offsets) {
  ring_of_segment_.assign(crossings.segments.size(), kNoRing);
  for (std::uint32_t ring = 0; ring + 1 < offsets.size(); ++ring) {
    for (std::uint32_t k = offsets[ring]; k < offsets[ring + 1]; ++k) {
      ring_of_segment_[segments[k]] = ring;
    }
  }
}

template <typename Visit>
void Scanlines::ForEachEdge(const TileDirectory& directory, const Crossings& crossings,
                            Visit visit) {
  // Every horizontal edge is the lower edge of one cell. If the edge is crossed, the first segment
  // of this cell runs through the edge.
  const auto crosses_lower_edge = [](const ActiveCell& cell) {
    return ((cell.corners ^ cell.corners >> 1) & 1) != 0;
  };
  for (const std::uint32_t index : cells_.List(directory, crossings, crosses_lower_edge)) {
    const ActiveCell& cell = crossings.cells[index];
    const std::uint32_t ring = ring_of_segment_[cell.first_segment];
    if (ring == kNoRing) continue;
    visit(CrossedEdge{.row = directory[cell.tile].y * kTileSize + cell.j,
                      .column = directory[cell.tile].x * kTileSize + cell.i,
                      .ring = ring,
                      .begins_inside = (cell.corners >> 1 & 1) != 0});
  }
}

}  // namespace partiemc
