// Rings as windows along them are read: straight, with neither end nor beginning.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace partiemc {

/// Numbers of a ring's vertices and of those that repeat it beyond each end.
struct UnrolledRingSize {
  std::uint32_t count = 0, margin = 0;
};

/// One ring. Arrays are by vertex, 0 <= k < count, and go on beyond both ends by `margin` vertices
/// that repeat the ring, so that a window is a contiguous stretch of them.
struct UnrolledRing {
  static constexpr int kArrays = 10;

  /// With arrays of which at(k) tells where the first vertex is.
  template <typename At>
  static UnrolledRing In(const UnrolledRingSize& size, At at) {
    return {.count = size.count,
            .margin = size.margin,
            .x = at(0),
            .y = at(1),
            .normal_x = at(2),
            .normal_y = at(3),
            .next_x = at(4),
            .next_y = at(5),
            .arc = at(6),
            .weight = at(7),
            .base = at(8),
            .shift = at(9)};
  }

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

/// Memory of one ring that is short enough for the stack: it stays in the cache.
class ShortRing {
 public:
  static bool Holds(const UnrolledRingSize& size) {
    return std::size_t{size.count} + 2 * std::size_t{size.margin} <= kRoom;
  }
  /// Requires: Holds(size). Valid as long as this object; elements have no values yet.
  UnrolledRing Of(const UnrolledRingSize& size) {
    return UnrolledRing::In(size, [&](int array) { return arrays_[array] + size.margin; });
  }

 private:
  static constexpr std::size_t kRoom = 768;
  double arrays_[UnrolledRing::kArrays][kRoom];
};

/// Memory of the rings of a frame, kept warm from frame to frame.
class UnrolledRings {
 public:
  using Size = UnrolledRingSize;

  /// Makes room for rings of the given numbers of vertices and margins; 0 vertices for a ring that
  /// has none here. Elements keep no values.
  std::vector<Size>& sizes() { return sizes_; }
  void Allocate();

  /// Requires: Allocate was called after `sizes` were set.
  UnrolledRing operator[](std::size_t ring);

 private:
  std::vector<Size> sizes_;
  std::vector<std::size_t> starts_;
  std::vector<double> arrays_[UnrolledRing::kArrays];
};

}  // namespace partiemc
