// Triangulates the region between two parallel loops in linear time, if it is simple enough.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// A fast alternative to Triangulator (triangulate.h) for a region between two loops that run side
/// by side, such as a ring and the staircase of the cells inside it.
///
/// Method: two walkers start next to each other, one on each loop, and walk around once. The front
/// is a polyline from one walker to the other. At each step one walker advances to its next point.
/// This point cuts off triangles at its end of the front while they are counter-clockwise, and then
/// joins the front.
///
/// Correctness: each triangle replaces two sides of the front by its third side. Apart from sides
/// that cancel, the sides of the triangles and the front therefore always sum to the first front
/// plus the paths of the walkers. After one round both walkers are back at their starts. If the
/// front is then again the single first side, the sides of the triangles sum to the loops alone. As
/// in side_balance.h, the number of triangles around a point is then the winding number of the
/// loops: 1 inside the region, 0 elsewhere. Any choice of walker is therefore correct; a bad choice
/// only leaves a longer front, and Triangulate returns false.
///
/// Reuses its buffers. Use one object per thread.
class LoopStrip {
 public:
  /// Appends one triangle for each point of the loops, all strictly counter-clockwise by
  /// Orientation. On failure, returns false and leaves `triangles` unchanged. Reasons:
  ///   - the front is not used up;
  ///   - the loops do not turn once each, in opposite directions;
  ///   - a coordinate is outside the domain of predicates.h.
  /// Requires: indices in range, no empty loop, and loops that meet the requirements of
  /// Triangulator. This is not checked: if the loops cross, triangles may overlap.
  /// Cost: linear in the points: two or three Orientations and two distances for each.
  [[nodiscard]] bool Triangulate(std::span<const double> points,
                                 std::span<const std::uint32_t> loop,
                                 std::span<const std::uint32_t> other,
                                 std::vector<std::uint32_t>& triangles);

 private:
  struct Vertex {
    Point point;
    std::uint32_t index = 0;
  };

  static int Turns(std::span<const Vertex> vertices);
  bool Collect(std::span<const double> points, std::span<const std::uint32_t> loop,
               std::span<const std::uint32_t> other);

  std::vector<Vertex> loop_, other_;  // In the order of the walkers; the first vertex is repeated.
  std::vector<Vertex> front_;         // Grows from the middle in both directions.
};

}  // namespace partiemc
