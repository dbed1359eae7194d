// Repairs the rings of the default placement, so that they do not cross and are nested correctly.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/result.h"
#include "vertices/intersections.h"
#include "vertices/ring_depths.h"

namespace partiemc {

/// In this number of rounds of a repair, points return only half way to their roots.
inline constexpr int kHalfWayRounds = 4;

/// Warm buffers of RepairRings.
struct RepairScratch {
  TouchingPairsBuffers pairs;
  std::vector<std::uint8_t> is_marked;   // By point.
  std::vector<std::uint32_t> misplaced;  // Rings.
  std::vector<Point> leftmost;           // By misplaced ring: its leftmost point.
  RingDepths ring_depths;
};

/// Moves points of `rings` back towards their roots (the anchors of core/METHOD.md) until the rings
/// are simple, do not touch and are nested by `outer_of`. `roots` has one root for each point of
/// the rings, interleaved, in world units.
///
/// If segments cross or touch, a round moves their ends, and the points next to these, half way
/// back; from the fifth round on all the way. Points near walls return all the way at once, because
/// half way along a bent wall may be behind it. Without such segments,
/// misplaced rings return as a whole, with the rings that may surround them; all rings return if
/// more than 100 are misplaced. A ring is misplaced if it is turned inside out, or if another ring
/// has passed over it. Ordinary frames need no round. After 24 rounds, or if a round would move no
/// point, all points return.
///
/// Returns false if rings cross or are misplaced with every point at its root. This is a bug,
/// because rings through the roots are simple and nested (core/METHOD.md, "Why rings are simple";
/// tests/core/roots_test.cc).
///
/// `near_walls`: by point, 1 near a wall; empty without walls.
///
/// Measures the rings (measure.h) unless it fails. Throws Cancelled (base/cancellation.h).
/// Cost: for each round near-linear in the points, n log n in local minima and maxima of the rings.
[[nodiscard]] bool RepairRings(std::span<const double> roots,
                               std::span<const std::uint8_t> near_walls, RepairScratch& scratch,
                               Rings& rings);

}  // namespace partiemc
