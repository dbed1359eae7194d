// Finds the pairs of related rings of two successive frames, and the number of nodes they share.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "identities/relations.h"
#include "identities/ring_samples.h"
#include "identities/run_overlaps.h"
#include "partiemc/state.h"

namespace partiemc {

/// The rings of this frame, by number.
struct RingsNow {
  std::span<const NodeRun> runs;       ///< `ring` is a number.
  std::span<const KnownRing> rings;    ///< `outer` is a number.
  std::span<const FoundSample> found;  ///< Sorted by `before`, then `now`.
  bool has_ids = false;
  double time = 0;
  double cell_size = 1;  ///< World units.
  LatticePeriods periods = {};
};

/// Scratch of RelateRings.
struct RelationScratch {
  std::vector<CellShift> shift_before, shift_now;
  std::vector<std::int64_t> displacements;
  std::vector<NodeRun> moved, wrapped;
  std::vector<NodeRun> wrapped_before, wrapped_now;  // Used only with a periodic box.
  std::vector<SharedNodes> shared;
  std::vector<std::uint32_t> newest;  // For FindSharedNodes.
  Evidence evidence;
};

/// Finds the related rings (core/IDENTITIES.md) by the nodes that they share after a movement.
/// Rings of the last frame move forward: by their samples if both frames have ids, else by their
/// velocities. In a second comparison, rings of this frame move backward by their velocities. Rings
/// without a relation that counts are compared once more where they are, except sampled rings. If
/// samples contradict the nodes, the samples decide. In a periodic box, nodes are wrapped first,
/// because a ring may change its image. `relations` has each pair once, in no particular order.
/// Cost: n log n in runs, rings and samples.
void RelateRings(const RingHistory& previous, const RingsNow& now, RelationScratch& scratch,
                 std::vector<Relation>& relations);

}  // namespace partiemc
