// Repairs the rings of the default placement, so that they do not cross and stay nested correctly.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/result.h"
#include "vertices/intersections.h"
#include "vertices/ring_depths.h"

namespace partiemc {

/// Warm buffers of RepairRings.
struct RepairScratch {
  TouchingPairsBuffers pairs;
  std::vector<std::uint8_t> is_marked;   // By point.
  std::vector<std::uint32_t> misplaced;  // Misplaced rings.
  std::vector<Point> leftmost;           // By misplaced ring: its leftmost point.
  RingDepths ring_depths;
};

/// Moves points of `rings` back towards their roots (the anchors of core/METHOD.md) until the rings
/// are simple, do not touch and are nested by `outer_of`. `roots` are interleaved, one for each
/// point of the rings, in world units.
///
/// If segments cross or touch, both ends of each segment and the points next to these move half way
/// back, from the fifth round on all the way. A ring is misplaced if it was turned inside out, or
/// if a larger ring has passed over it. A misplaced ring returns as a whole, together with the
/// rings around it. Ordinary frames need no round. After 24 rounds, all points return.
///
/// Returns false if rings still cross or are misplaced with every point at its root. This is a bug,
/// because rings through the roots are simple and nested. A path between two roots stays in one
/// cell or crosses the common edge of two cells. No other path crosses that edge, and in a saddle
/// each path has its own half of the cell (core/METHOD.md, "Why rings are simple";
/// tests/core/roots_test.cc).
///
/// Measures the rings (measure.h) unless it fails.
/// Cost: for each round near-linear in the points, n log n in local minima and maxima of the rings.
[[nodiscard]] bool RepairRings(std::span<const double> roots, RepairScratch& scratch, Rings& rings);

}  // namespace partiemc
