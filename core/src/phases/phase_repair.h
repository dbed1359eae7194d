// Repairs the outlines of a body and of its phases, which share points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/result.h"
#include "phases/phase_rings.h"
#include "vertices/intersections.h"
#include "vertices/repair.h"
#include "vertices/ring_depths.h"

namespace partiemc {

/// Scratch of RepairPhases.
struct PhaseRepairScratch {
  TouchingPairsBuffers pairs;
  RingDepths depths;
  std::vector<double> gathered;         // Points of one outline.
  std::vector<std::uint8_t> is_marked;  // By shared point.
};

/// Moves shared points back to their roots until the outlines of the body and of each phase are
/// valid: rings are simple, do not touch, and are nested by their topologies. Then no two phases
/// overlap, and none leaves the body (core/PHASES.md, "Why phases do not overlap").
///
/// In each round, the ends of touching segments and their neighbours return half way, from the
/// fifth round on, and near walls, all the way. If no segments touch, an outline with
/// misplaced rings returns as a whole. After 24 rounds all points return. `points`, `roots`: by
/// shared point, interleaved, in world units. Returns false if outlines are not valid with all
/// points at their roots, which is a bug. Cost: for each round and outline as CountTouchingPairs
/// and RingDepths.
[[nodiscard]] bool RepairPhases(const Rings& body, std::span<const PhaseRings> phases,
                                std::span<const double> roots,
                                std::span<const std::uint8_t> near_walls,
                                PhaseRepairScratch& scratch, std::span<double> points);

}  // namespace partiemc
