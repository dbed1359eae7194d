// The last step of the default placement: rings that neither cross nor trade places.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "intersections.h"
#include "partiemc/result.h"

namespace partiemc {

/// Warm buffers of RepairRings.
struct RepairScratch {
  struct Box {
    double x0, x1, y0, y1;
    std::uint32_t leftmost;  // Index of the point with the smallest x, then y.
  };
  TouchingPairsBuffers pairs;
  std::vector<std::uint8_t> is_marked;  // Per point.
  std::vector<Box> boxes;               // Per ring.
  std::vector<std::uint32_t> order, open;
};

/// Moves points of `rings` back towards their roots until the rings are simple, do not touch and
/// lie in each other as `outer_of` says. `roots` are interleaved, one per point of the rings, in
/// world units; rings through the roots are so by construction.
///
/// Where segments cross or touch, the points at and next to them go half way back, from the fifth
/// round on all the way. A ring that lies on the wrong side of another one without crossing it (it
/// is small, and the other one has passed over it), or that was turned inside out, goes back as a
/// whole, with those around it. Ordinary frames need no round.
/// Ends: from the fifth round on each brings at least one more point to its root.
/// Measures the rings (measure.h) as they are in the end.
/// Cost: near-linear in the points for each round.
void RepairRings(std::span<const double> roots, RepairScratch& scratch, Rings& rings);

}  // namespace partiemc
