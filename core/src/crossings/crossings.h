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

struct ActiveCell {
  std::uint32_t tile = 0;
  std::uint8_t i = 0, j = 0;
  std::uint8_t corners = 0;  ///< The case, 1 to 14.
  std::uint8_t joined = 0;   ///< Saddles only: 1 if the inside corners are joined.
  /// The first of its segments; a saddle has two. If one runs through edge 0, it is the first.
  std::uint32_t first_segment = 0;

  bool IsSaddle() const { return corners == 5 || corners == 10; }
};

struct Segment {
  std::uint32_t cell = 0;
  std::uint8_t entry = 0, exit = 0;  ///< Edges of the cell.
};

/// Nodes and cells of a tile as bits.
struct TileBits {
  BitRows inside{};                                  ///< The node is inside.
  BitRows active{};                                  ///< The cell has inside and outside corners.
  std::uint32_t first_cell = 0;                      ///< Index of the tile's first active cell.
  std::array<std::uint16_t, kTileSize> row_cells{};  ///< By row: active cells in lower rows.
};

/// Numbers of cells and segments.
struct CrossingCounts {
  std::uint32_t cells = 0, segments = 0;
};

struct Crossings {
  std::vector<TileBits> tiles;
  std::vector<BitRows> interior;  ///< By tile: cells with all corners inside.
  std::vector<ActiveCell> cells;  ///< By tile, row, column.
  std::vector<Segment> segments;  ///< By cell.

  std::vector<CrossingCounts> counts;  ///< Scratch: before each tile, and the total.
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

/// The inside nodes of a tile, with the row above and the column right of it. Bit i of row j of
/// `left` is node (i, j), of `right` node (i + 1, j), so cell (i, j) has bit i of rows j and j + 1
/// of both as corners.
struct NodeRows {
  std::array<std::uint32_t, kTileSize + 1> left, right;
};
NodeRows InsideRows(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                    std::uint32_t tile);

/// Index of an active cell. Requires: the cell is active.
std::uint32_t CellAt(const Crossings& crossings, const TilePlace& place);

/// The next segment of the outline: it enters the neighbouring cell through the exit edge of
/// `segment`.
std::uint32_t NextSegment(const TileDirectory& directory, const Crossings& crossings,
                          std::uint32_t segment);

/// Lower left node of a cell.
inline Point CellOrigin(const TileDirectory& directory, const ActiveCell& cell) {
  const TileCoordinate& tile = directory[cell.tile];
  return {static_cast<double>((std::int64_t{tile.x} << kTileShift) + cell.i),
          static_cast<double>((std::int64_t{tile.y} << kTileShift) + cell.j)};
}

/// Distance of a crossing from the ends of its edge, in cells.
inline constexpr double kEdgeMargin = 1.0 / 4096;

/// The crossing of the outline with `edge` of `cell`, by linear interpolation of F. Both cells of
/// an edge get the same bits. Kept 2^-12 cells away from the nodes, so that rounding to world
/// coordinates cannot move it to a node. Inline and without a branch on the edge: the crossings of
/// many cells wait for memory at the same time.
inline Point EdgeCrossing(const TileDirectory& directory, const LevelSet& level_set,
                          const ActiveCell& cell, int edge) {
  // From the lower or left node, so that both cells compute the same.
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
