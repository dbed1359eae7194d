// The vertices of all rings while the default placement moves them.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "crossings.h"

namespace partiemc {

/// Two vertices per segment of the topology, ring after ring: the crossing of its entry edge, then
/// the vertex of its cell. Struct of arrays, lengths in cells, positions in lattice coordinates of
/// the world. Segment k has vertices 2 k and 2 k + 1.
struct RingVertices {
  std::vector<LatticePoint> point;
  /// Where a vertex may always retreat to: with all vertices there, rings are simple.
  std::vector<LatticePoint> root;
  std::vector<LatticePoint> normal;  ///< Unit, outward.
  std::vector<double> step;          ///< Length of the segment from this vertex to the next.
  std::vector<double> weight;        ///< l: half of the two segments at the vertex.
  std::vector<double> base;          ///< Shift along the normal that the vertex's plane asks for.
  std::vector<double> shift;         ///< Scratch of the steps.
  std::vector<LatticePoint> next_normal;  ///< Scratch of the steps.
  std::vector<std::uint8_t> is_kept;      ///< 0 for vertices that thinning dropped.

  void Resize(std::size_t count);
};

/// The vertices [first, first + count) of RingVertices as a closed ring.
class RingView {
 public:
  RingView(RingVertices& vertices, std::size_t first, std::size_t count)
      : vertices_(vertices), first_(first), count_(count) {}

  /// Sets step and weight of every vertex; returns the length of the ring.
  double Measure() const;

  std::size_t size() const { return count_; }
  std::size_t index(std::size_t k) const { return first_ + k; }

  /// Calls visit(index, d) for the vertices whose distance d along the ring from the k-th is less
  /// than `reach`: itself, then those after it, then those before it, none of them twice.
  template <typename Visit>
  void ForEachNear(std::size_t k, double reach, Visit visit) const;

 private:
  RingVertices& vertices_;
  std::size_t first_, count_;
};

template <typename Visit>
void RingView::ForEachNear(std::size_t k, double reach, Visit visit) const {
  visit(first_ + k, 0.0);
  // At most half of the ring in each direction, so that no vertex is met from both.
  const std::size_t after = count_ / 2;
  const std::size_t before = (count_ - 1) / 2;
  std::size_t at = k;
  double distance = 0;
  for (std::size_t n = 0; n < after; ++n) {
    distance += vertices_.step[first_ + at];
    if (distance >= reach) break;
    at = at + 1 == count_ ? 0 : at + 1;
    visit(first_ + at, distance);
  }
  at = k;
  distance = 0;
  for (std::size_t n = 0; n < before; ++n) {
    at = at == 0 ? count_ - 1 : at - 1;
    distance += vertices_.step[first_ + at];
    if (distance >= reach) break;
    visit(first_ + at, distance);
  }
}

}  // namespace partiemc
