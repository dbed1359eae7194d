// Rings as windows along them are read: straight, with neither end nor beginning.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace partiemc {

/// One ring. Arrays are by vertex, 0 <= k < count, and go on beyond both ends by `margin` vertices
/// that repeat the ring, so that a window is a contiguous stretch of them.
struct UnrolledRing {
  std::ptrdiff_t count, margin;
  double *x, *y;                ///< Lattice coordinates of the world, in cells.
  double *normal_x, *normal_y;  ///< Unit, outward.
  double *next_x, *next_y;      ///< Scratch: the normals of the next step; then the strips.
  double* arc;                  ///< Length of the ring up to the vertex; ascends in margins, too.
  double* weight;               ///< l: half of the two segments at the vertex.
  double* base;                 ///< Shift along the normal that the vertex's plane asks for.
  double* shift;                ///< Scratch of the steps; has no margins.

  /// Writes the elements [begin, end) of one of the arrays to where they are repeated. Different
  /// elements are repeated in different places.
  void Repeat(double* values, std::ptrdiff_t begin, std::ptrdiff_t end) const;
};

/// Memory of the rings of a frame, kept warm from frame to frame.
class UnrolledRings {
 public:
  /// Makes room for rings of the given numbers of vertices and margins; 0 vertices for a ring that
  /// is not unrolled. Elements keep no values.
  struct Size {
    std::uint32_t count = 0, margin = 0;
  };
  std::vector<Size>& sizes() { return sizes_; }
  void Allocate();

  /// Requires: Allocate was called after `sizes` were set.
  UnrolledRing operator[](std::size_t ring);

 private:
  std::vector<Size> sizes_;
  std::vector<std::size_t> starts_;
  std::vector<double> arrays_[10];
};

}  // namespace partiemc
