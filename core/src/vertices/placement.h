// Places the vertex of one cell (paper, sections 3.4-3.5).
#pragma once

#include <algorithm>
#include <span>

#include "vertices/vertices.h"

namespace partiemc {

/// Distance between clamped vertices and the sides of their cells, in cells. With this distance,
/// rounding to world coordinates neither joins neighbouring vertices nor moves one across a side.
inline constexpr double kCellMargin = 1.0 / 1024;

/// Sets coordinates, in world units, that are closer to an axis than 2^-96 cells to 0: predicates.h
/// is not exact for tiny ones.
void SnapToAxes(double cell_size, std::span<double> coordinates);

/// Moves a point of a saddle cell into the half of the cell that belongs to `segment`. Coordinates
/// are relative to the cell.
/// Requires: the point is at least kCellMargin away from the sides.
Point ClampToHalf(const Segment& segment, Point point);

/// Moves `point` into its cell, kCellMargin away from the sides. In a saddle, `point` moves into
/// the half that belongs to `segment`, so that the two segments never meet; other cells ignore
/// `segment`.
inline Point ClampToCell(const TileDirectory& directory, const ActiveCell& cell,
                         const Segment& segment, Point point) {
  const Point origin = CellOrigin(directory, cell);
  Point of_cell{std::clamp(point.x - origin.x, kCellMargin, 1 - kCellMargin),
                std::clamp(point.y - origin.y, kCellMargin, 1 - kCellMargin)};
  if (cell.IsSaddle()) of_cell = ClampToHalf(segment, of_cell);
  return {origin.x + of_cell.x, origin.y + of_cell.y};
}

/// Minimises sum_j (n_j . (v - p_j))^2 over the segment's two ends (Eq. 14), in closed form. Along
/// a direction that the normals barely constrain, the vertex stays at the middle of the segment. In
/// lattice coordinates.
Point QefVertex(const VertexInput& input, const CellPlane& plane);

}  // namespace partiemc
