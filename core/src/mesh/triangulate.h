// Triangulates regions bounded by closed loops, without adding a point.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace partiemc {

/// Triangulates the region that lies to the left of all loops: outer loops counter-clockwise, holes
/// clockwise, islands in holes and any number of components allowed, in any order.
///
/// Method: one sweep over the points in the order of SweepsBefore (point.h). Each interval between
/// a left and a right edge on the sweep line holds the piece of the region below it that is still
/// to be triangulated, which is monotone: the sweep cuts the region at each point that would make
/// it otherwise, and the pieces are triangulated as it goes. After Garey, Johnson, Preparata and
/// Tarjan, "Triangulating a simple polygon", Information Processing Letters 7 (1978), and Hertel
/// and Mehlhorn, "Fast triangulation of the plane with respect to simple polygons", Information and
/// Control 64 (1985). Every decision is an exact Orientation.
///
/// The result depends on the input only, bit for bit. One object per thread; it keeps its buffers
/// warm and allocates nothing for an input no larger than one before. Assign a new one to free
/// them.
class Triangulator {
 public:
  Triangulator();
  ~Triangulator();
  Triangulator(Triangulator&&) noexcept;
  Triangulator& operator=(Triangulator&&) noexcept;

  /// Appends the triangles, three point indices each, to `triangles`. Loop k runs through the
  /// points loop_points[loop_offsets[k]] up to, but not including, loop_points[loop_offsets[k +
  /// 1]], and back to its first.
  ///
  /// Requires, and checks:
  ///   1. coordinates in the domain of predicates.h, indices and offsets in their ranges, at least
  ///      three points in a loop, and neighbours on a loop at different places;
  ///   2. no two edges cross or overlap, and none runs through a point of another: loops may meet
  ///      each other and themselves, but only at points that both of them name (a "pinch": by the
  ///      same index, or by indices of points at the same place);
  ///   3. the left side of every edge is inside, the right side outside.
  /// Points may be collinear, in any number; several may have equal x or equal y.
  ///
  /// Returns true if and only if the input is so. Then
  ///   - every triangle is strictly counter-clockwise by Orientation;
  ///   - triangles do not overlap and cover exactly the region;
  ///   - their number is n - 2 outers + 2 holes, for n points on the loops, when there is no pinch.
  ///     At a pinch, count the loops that result from turning there so that the region on the left
  ///     is never left or crossed (two squares that share a corner are two loops, even if given as
  ///     one);
  ///   - of several points at one place, the triangles name the one of lowest index.
  /// Otherwise `triangles` is as it was.
  ///
  /// Cost: n log n for the searches, and for the sort where heights crowd, plus n times the square
  /// root of the number of edges that a line meets, with a tiny factor. Memory: about 150 bytes per
  /// point on the loops.
  [[nodiscard]] bool Triangulate(std::span<const double> points,
                                 std::span<const std::uint32_t> loop_points,
                                 std::span<const std::uint32_t> loop_offsets,
                                 std::vector<std::uint32_t>& triangles);

 private:
  class Sweep;
  std::unique_ptr<Sweep> sweep_;
};

}  // namespace partiemc
