// Stage 3 of 9: finds the active cells and the segments of the outline through them.
//
//    3--2--2     Corners and edges of a cell. Bit k of a cell's case is set if corner k is
//    |     |     inside (F < 0). F = 0 counts as outside in every stage, so the outline
//    3     1     never runs through a node.
//    |     |
//    0--0--1     A segment enters the cell through one edge and leaves through another, with the
//                inside on its left. Cases 5 and 10 have two segments. The asymptotic decider
//                (Nielson and Hamann 1991) joins or separates their inside corners.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "base/point.h"
#include "bins/lattice.h"
#include "field/field.h"

namespace partiemc {

/// The corners of a cell, relative to its first one.
inline constexpr int kCornerX[4] = {0, 1, 1, 0}, kCornerY[4] = {0, 0, 1, 1};

struct ActiveCell {
  std::uint32_t tile = 0;
  std::uint8_t i = 0, j = 0;
  std::uint8_t corners = 0;  ///< The case, 1 to 14.
  std::uint8_t joined = 0;   ///< Saddles only: 1 if the inside corners are joined.
  /// Index of the cell's first segment; a saddle has two segments. If a segment runs through edge
  /// 0, it is the first one.
  std::uint32_t first_segment = 0;

  bool IsSaddle() const { return corners == 5 || corners == 10; }
};

struct Segment {
  std::uint32_t cell = 0;
  std::uint8_t entry = 0, exit = 0;  ///< Edges of the cell.
};

/// Nodes and cells of a tile as bits.
struct TileBits {
  BitRows inside{};                                  ///< Nodes that are inside.
  BitRows active{};                                  ///< Cells with inside and outside corners.
  std::uint32_t first_cell = 0;                      ///< Index of the tile's first active cell.
  std::array<std::uint16_t, kTileSize> row_cells{};  ///< By row: active cells in the rows below.
};

struct CrossingCounts {
  std::uint32_t cells = 0, segments = 0;
};

struct Crossings {
  std::vector<TileBits> tiles;
  std::vector<BitRows> interior;  ///< By tile: cells with all corners inside.
  std::vector<ActiveCell> cells;  ///< Sorted by tile, row, column.
  std::vector<Segment> segments;  ///< Sorted by cell.

  std::vector<CrossingCounts> counts;  ///< Scratch, by tile: sum of earlier tiles; last: the total.
};

/// Finds the active cells of a level set and their segments. Deterministic, parallel over tiles:
/// count, prefix sum, fill. Cost: linear in nodes.
void FindCrossings(const TileDirectory& directory, const LevelSet& level_set, Crossings& crossings);

/// Recomputes the interior cells after cleaning changed the inside nodes.
void MarkInteriorCells(const TileDirectory& directory, Crossings& crossings);

/// Whether a node exists and is inside.
inline bool IsInside(const Crossings& crossings, const TilePlace& node) {
  return node.tile != kNoTile && (crossings.tiles[node.tile].inside[node.j] >> node.i & 1) != 0;
}

/// The inside nodes of a tile, of the row above it and of the column right of it. Bit i of row j is
/// node (i, j) in `left` and node (i + 1, j) in `right`. The corners of cell (i, j) are therefore
/// bit i of the rows j and j + 1 in both arrays.
struct NodeRows {
  std::array<std::uint32_t, kTileSize + 1> left, right;
};
NodeRows InsideRows(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                    std::uint32_t tile);

/// Joins the inside corners of a saddle, which must not be joined yet.
void JoinSaddle(Crossings& crossings, std::uint32_t cell);

/// Index of an active cell. Requires: the cell is active.
std::uint32_t CellAt(const Crossings& crossings, const TilePlace& place);

/// The next segment of the outline, which enters the neighbouring cell through the exit edge of
/// `segment`.
std::uint32_t NextSegment(const TileDirectory& directory, const Crossings& crossings,
                          std::uint32_t segment);

/// Lower left node of a cell, in cells from the world's origin.
inline Point CellOrigin(const TileDirectory& directory, const ActiveCell& cell) {
  const TileCoordinate& tile = directory[cell.tile];
  return {static_cast<double>((std::int64_t{tile.x} << kTileShift) + cell.i),
          static_cast<double>((std::int64_t{tile.y} << kTileShift) + cell.j)};
}

/// Least distance of a crossing from the ends of its edge, in cells.
inline constexpr double kEdgeMargin = 1.0 / 4096;

/// The crossing of the outline with `edge` of `cell`, by linear interpolation of F, in cells from
/// the world's origin. The crossing stays kEdgeMargin away from the nodes, so that rounding to
/// world coordinates cannot move it to a node. The function is inline and has no branch on `edge`,
/// so that the memory accesses of many cells overlap.
inline Point EdgeCrossing(const TileDirectory& directory, const LevelSet& level_set,
                          const ActiveCell& cell, int edge) {
  // Both cells of the edge interpolate from its lower or left node, so they get the same bits.
  const int right = edge == 1, up = edge == 2;
  const int along_x = ~edge & 1, along_y = edge & 1;
  const int i = cell.i + right;
  const int j = cell.j + up;
  const double a = level_set.At(directory, cell.tile, i, j);
  const double b = level_set.At(directory, cell.tile, i + along_x, j + along_y);
  const double t = std::clamp(a / (a - b), kEdgeMargin, 1 - kEdgeMargin);
  const Point origin = CellOrigin(directory, cell);
  return {origin.x + (right + along_x * t), origin.y + (up + along_y * t)};
}

}  // namespace partiemc
