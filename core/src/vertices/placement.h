// Where the vertex of one cell goes, for each placement (paper, sections 3.4-3.5).
#pragma once

#include <algorithm>
#include <cmath>

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

/// `point`, where F has this value and gradient, moved by one Newton step towards F = 0, of at most
/// `max_step` cells; `point` itself where the gradient is weak.
inline Point NewtonStep(Point point, double value, Point gradient, double max_step) {
  const double square = gradient.x * gradient.x + gradient.y * gradient.y;
  if (square < kWeakGradientSquare) return point;
  double step = -value / square;
  // Its length is that of the gradient times as much.
  if (step * step * square > max_step * max_step) {
    step = std::copysign(max_step / std::sqrt(square), step);
  }
  return {point.x + step * gradient.x, point.y + step * gradient.y};
}

/// One Newton step from the middle of the segment to F = 0 along the cell plane's normal, of at
/// most `max_step` cells; none where the gradient is weak. In lattice coordinates.
Point VirtualPlaneVertex(const CellPlane& plane, double max_step);

/// Minimiser of sum_j (n_j . (v - p_j))^2 over the segment's two ends (Eq. 14), in closed form;
/// directions that the normals hardly constrain stay at the middle. In lattice coordinates.
Point QefVertex(const VertexInput& input, std::uint32_t segment, const CellPlane& plane);

/// The particle that lies farthest along the plane's normal, among those on or above the plane and
/// within one cell (and one kernel radius) of its point; the middle of the segment if there is
/// none. In world units, moved outward by the surface offset.
Point FarthestParticleVertex(const VertexInput& input, std::uint32_t segment,
                             const CellPlane& plane);

}  // namespace partiemc
