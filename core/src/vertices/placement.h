// Where the vertex of one cell goes, for each placement (paper, sections 3.4-3.5).
#pragma once

#include <algorithm>

#include "vertices/vertices.h"

namespace partiemc {

/// Vertices keep this share of a cell away from its sides, so that neighbouring vertices neither
/// meet nor change sides when they are rounded to world coordinates.
inline constexpr double kCellMargin = 1.0 / 1024;

/// A point of a saddle's cell, kCellMargin or more away from its sides, moved into the half of it
/// that belongs to `segment`. Relative to the cell.
Point ClampToHalf(const Segment& segment, Point point);

/// `point` moved into the cell of `segment`, a little away from its sides; in a saddle into the
/// half of the cell that belongs to the segment, so that its two segments never meet. Only there
/// the segment is looked at.
inline Point ClampToCell(const TileDirectory& directory, const ActiveCell& cell,
                         const Segment& segment, Point point) {
  const Point origin = CellOrigin(directory, cell);
  Point of_cell{std::clamp(point.x - origin.x, kCellMargin, 1 - kCellMargin),
                std::clamp(point.y - origin.y, kCellMargin, 1 - kCellMargin)};
  if (cell.IsSaddle()) of_cell = ClampToHalf(segment, of_cell);
  return {origin.x + of_cell.x, origin.y + of_cell.y};
}

/// Minimiser of sum_j (n_j . (v - p_j))^2 over the segment's two ends (Eq. 14), in closed form;
/// directions that the normals hardly constrain stay at the middle. In lattice coordinates.
Point QefVertex(const VertexInput& input, const CellPlane& plane);

}  // namespace partiemc
