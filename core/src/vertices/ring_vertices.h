// The vertices of all rings while the default placement moves them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "crossings/crossings.h"
#include "vertices/unrolled_rings.h"

namespace partiemc {

/// Unit, outward.
struct VertexNormal {
  float x = 0, y = 0;
};

/// Two vertices per segment of the topology, ring after ring: the crossing of its entry edge, then
/// the vertex of its cell. Lengths in cells, positions in lattice coordinates of the world. Segment
/// k has vertices 2 k and 2 k + 1.
struct RingVertices {
  std::vector<Point> point;
  /// Where a vertex may always retreat to: with all vertices there, rings are simple.
  std::vector<Point> root;
  std::vector<VertexNormal> normal;
  std::vector<std::uint8_t> is_kept;  ///< 0 for vertices that thinning dropped.
  UnrolledRings unrolled;             ///< Scratch of the steps.

  void Resize(std::size_t count) {
    point.resize(count);
    root.resize(count);
    normal.resize(count);
    is_kept.resize(count);
  }
};

}  // namespace partiemc
