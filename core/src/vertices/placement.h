// Places the vertex of one cell (paper, sections 3.4-3.5).
#pragma once

#include <algorithm>
#include <span>

#include "vertices/vertices.h"

namespace partiemc {

/// Least distance between clamped vertices and the sides of their cells, in cells. With this limit,
/// rounding to world coordinates neither joins neighbouring vertices nor moves one across a side.
inline constexpr double kCellMargin = 1.0 / 1024;

/// Sets coordinates nearer to 0 than 2^-96 cells to 0, because predicates.h is not exact for tiny
/// ones. `coordinates` and `cell_size` are in world units.
void SnapToAxes(double cell_size, std::span<double> coordinates);

/// Moves a point of a saddle cell into the half of the cell that belongs to `segment`: the half
/// with the corner that the segment cuts off. `point` is in cells relative to the cell, at least
/// kCellMargin away from the sides of the cell.
Point ClampToHalf(const Segment& segment, Point point);

/// Moves `point`, in cells from the origin of the world, into `cell`, at least kCellMargin away
/// from the sides. In a saddle the point moves into the half that belongs to `segment`, so that the
/// two segments never meet. Other cells ignore `segment`.
inline Point ClampToCell(const TileDirectory& directory, const ActiveCell& cell,
                         const Segment& segment, Point point) {
  const Point origin = CellOrigin(directory, cell);
  Point of_cell{std::clamp(point.x - origin.x, kCellMargin, 1 - kCellMargin),
                std::clamp(point.y - origin.y, kCellMargin, 1 - kCellMargin)};
  if (cell.IsSaddle()) of_cell = ClampToHalf(segment, of_cell);
  return {origin.x + of_cell.x, origin.y + of_cell.y};
}

/// The point v that minimises the sum of (n_j . (v - p_j))^2 over the segment's two ends p_j, whose
/// normals are n_j (Eq. 14). Along a direction that the normals barely constrain, v stays at the
/// middle of the segment. In cells from the origin of the world; may lie outside of the cell.
Point QefVertex(const VertexInput& input, const CellPlane& plane);

}  // namespace partiemc
