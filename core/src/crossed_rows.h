// The rows of the lattice as the rings cross them: tells which nodes rings enclose without filling.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cells_by_row.h"
#include "crossings.h"
#include "lattice.h"
#include "partiemc/result.h"

namespace partiemc {

/// A horizontal lattice edge that a ring crosses. Along a row, edges that begin an inside stretch
/// and edges that end one alternate, beginning with one that begins.
struct CrossedEdge {
  std::int32_t row = 0, column = 0;  ///< Its left node, in cells from the world's origin.
  std::uint32_t ring = kNoRing;
  bool begins_inside = false;  ///< Its right node is inside; otherwise its left one is.
};

/// Keeps its memory warm from frame to frame.
class CrossedRows {
 public:
  /// Ring k has segments [offsets[k], offsets[k + 1]); segments of no ring are not visited.
  void SetRings(const Crossings& crossings, std::span<const std::uint32_t> segments,
                std::span<const std::uint32_t> offsets);

  /// Calls visit(CrossedEdge) for each horizontal edge that a ring crosses, by row, then column.
  /// Cost: linear in segments and tiles.
  template <typename Visit>
  void ForEachEdge(const TileDirectory& directory, const Crossings& crossings, Visit visit);

 private:
  template <typename Visit>
  void VisitCell(const TileDirectory& directory, const Crossings& crossings, const ActiveCell& cell,
                 Visit visit) const;

  std::vector<std::uint32_t> ring_of_segment_;
  std::vector<std::uint32_t> next_cell_;  // By tile.
};

inline void CrossedRows::SetRings(const Crossings& crossings,
                                  std::span<const std::uint32_t> segments,
                                  std::span<const std::uint32_t> offsets) {
  ring_of_segment_.assign(crossings.segments.size(), kNoRing);
  for (std::uint32_t ring = 0; ring + 1 < offsets.size(); ++ring) {
    for (std::uint32_t k = offsets[ring]; k < offsets[ring + 1]; ++k) {
      ring_of_segment_[segments[k]] = ring;
    }
  }
}

template <typename Visit>
void CrossedRows::VisitCell(const TileDirectory& directory, const Crossings& crossings,
                            const ActiveCell& cell, Visit visit) const {
  const std::uint32_t end = cell.first_segment + (cell.IsSaddle() ? 2 : 1);
  for (std::uint32_t segment = cell.first_segment; segment < end; ++segment) {
    const Segment& here = crossings.segments[segment];
    // Edge 0, the cell's lower one: every horizontal edge is that of one cell. What enters through
    // it has the inside on its left.
    if (here.entry != 0 && here.exit != 0) continue;
    if (ring_of_segment_[segment] == kNoRing) continue;
    visit(CrossedEdge{.row = directory[cell.tile].y * kTileSize + cell.j,
                      .column = directory[cell.tile].x * kTileSize + cell.i,
                      .ring = ring_of_segment_[segment],
                      .begins_inside = here.exit == 0});
  }
}

template <typename Visit>
void CrossedRows::ForEachEdge(const TileDirectory& directory, const Crossings& crossings,
                              Visit visit) {
  ForEachCellByRow(directory, crossings, next_cell_, [&](std::uint32_t cell) {
    VisitCell(directory, crossings, crossings.cells[cell], visit);
  });
}

}  // namespace partiemc
