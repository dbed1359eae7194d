// The last step of the default placement: rings that neither cross nor trade places.
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
  std::vector<std::uint8_t> is_marked;   // Per point.
  std::vector<std::uint32_t> misplaced;  // Rings.
  std::vector<Point> leftmost;           // By these.
  RingDepths ring_depths;
};

/// Moves points of `rings` back towards their roots until the rings are simple, do not touch and
/// lie in each other as `outer_of` says. `roots` are interleaved, one per point of the rings, in
/// world units.
///
/// Where segments cross or touch, the points at and next to them go half way back, from the fifth
/// round on all the way. A ring that lies on the wrong side of another one without crossing it (it
/// is small, and the other one has passed over it), or that was turned inside out, goes back as a
/// whole, with those around it. Ordinary frames need no round. After the twenty-fourth, everything
/// goes back.
///
/// Ends, and in such rings: rings through the roots are so (core/METHOD.md, "Why rings are
/// simple"). Should that be wrong, `tangled` names the outer rings of all that still cross or are
/// misplaced, ascending, with every point at its root; else it is empty.
///
/// Measures the rings (measure.h) as they are in the end.
/// Cost: for each round near-linear in the points, and n log n in the places where rings turn.
void RepairRings(std::span<const double> roots, RepairScratch& scratch, Rings& rings,
                 std::vector<std::uint32_t>& tangled);

}  // namespace partiemc
