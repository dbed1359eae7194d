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
/// Returns false if the rings still cross or are misplaced with every point at its root. That is a
/// bug, because rings through the roots are simple and nested: a path from root to root stays in
/// one cell, or crosses the common edge of two cells, and no other path does either (in a saddle,
/// each has its own half). So rings meet only where they share a root, and they separate the same
/// lattice nodes as the rings of RingTopology. core/METHOD.md, "Why rings are simple", has the
/// details; tests/core/roots_test.cc tries to refute them.
///
/// Measures the rings (measure.h) unless it fails.
/// Cost: for each round near-linear in the points, and n log n in the places where rings turn.
[[nodiscard]] bool RepairRings(std::span<const double> roots, RepairScratch& scratch, Rings& rings);

}  // namespace partiemc
