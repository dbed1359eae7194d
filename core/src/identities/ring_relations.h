// Finds the pairs of related rings of two successive frames, and the number of nodes they share.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "identities/ring_samples.h"
#include "identities/run_overlaps.h"
#include "partiemc/state.h"

namespace partiemc {

/// The rings of this frame, by number.
struct RingsNow {
  std::span<const NodeRun> runs;       ///< `ring` is a number.
  std::span<const KnownRing> rings;    ///< `outer` is a number.
  std::span<const FoundSample> found;  ///< By `before`, then `now`.
  bool has_ids = false;
  double time = 0;
  double cell_size = 1;  ///< World units.
};

/// A ring of the last frame and a ring of this frame that may continue it. Either both are outer
/// rings or both are holes.
struct RingRelation {
  std::uint32_t before = 0, now = 0;  ///< Index in the last frame's history; number now.
  std::uint64_t nodes = 0;            ///< Shared nodes, counted or estimated from samples.
  std::uint32_t samples = 0;          ///< Samples of `before` that are in `now`.
  bool counts = false;                ///< Shares at least a quarter of the smaller ring's nodes.
};

/// Warm buffers of RelateRings.
struct RelationScratch {
  std::vector<CellShift> shift_before, shift_now;
  std::vector<std::int64_t> displacements;
  std::vector<NodeRun> moved;
  std::vector<SharedNodes> shared;
  std::vector<std::uint32_t> newest;  // For FindSharedNodes.
  std::vector<std::uint64_t> nodes_before, nodes_now;
  std::vector<std::uint32_t> sample_count;  // By ring of the last frame.
  std::vector<std::uint64_t> accounted;     // By number: nodes that the samples account for.
  std::vector<std::uint8_t> linked_before, linked_now;
};

/// Finds the related rings (core/IDENTITIES.md). Rings move by the displacement of their samples,
/// else by their velocities, else not at all; then the nodes that they share are counted. If
/// samples contradict the nodes, the samples decide. `relations` has each pair once, in no
/// particular order.
/// Cost: n log n in runs, rings and samples.
void RelateRings(const RingHistory& previous, const RingsNow& now, RelationScratch& scratch,
                 std::vector<RingRelation>& relations);

}  // namespace partiemc
