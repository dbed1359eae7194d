// The rows of the lattice as the rings cross them: tells which nodes rings enclose without filling.
#pragma once

#include <hwy/cache_control.h>

#include <cstdint>
#include <span>
#include <vector>

#include "bins/lattice.h"
#include "crossings/cells_by_row.h"
#include "crossings/crossings.h"
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
  // How many cells before its turn one's ring is asked for.
  static constexpr std::size_t kFetchedAhead = 16;

  std::vector<std::uint32_t> ring_of_segment_;
  CellsByRow cells_;
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
void CrossedRows::ForEachEdge(const TileDirectory& directory, const Crossings& crossings,
                              Visit visit) {
  // Every horizontal edge is the lower one of one cell, whose first segment runs through it.
  const auto crosses_lower_edge = [](const ActiveCell& cell) {
    return ((cell.corners ^ cell.corners >> 1) & 1) != 0;
  };
  const std::span<const std::uint32_t> order =
      cells_.List(directory, crossings, crosses_lower_edge);
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k + kFetchedAhead < order.size()) {
      const ActiveCell& soon = crossings.cells[order[k + kFetchedAhead]];
      hwy::Prefetch(&ring_of_segment_[soon.first_segment]);
    }
    const ActiveCell& cell = crossings.cells[order[k]];
    const std::uint32_t ring = ring_of_segment_[cell.first_segment];
    if (ring == kNoRing) continue;
    visit(CrossedEdge{.row = directory[cell.tile].y * kTileSize + cell.j,
                      .column = directory[cell.tile].x * kTileSize + cell.i,
                      .ring = ring,
                      .begins_inside = (cell.corners >> 1 & 1) != 0});
  }
}

}  // namespace partiemc
