// Which rings of two successive frames are related, and how much they have in common.
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

/// A ring of the last frame (index in its history) and one of this frame (number), both outer or
/// both holes.
struct RingRelation {
  std::uint32_t before = 0, now = 0;
  std::uint64_t nodes = 0;    ///< That they share, by nodes or as the samples tell.
  std::uint32_t samples = 0;  ///< Of the former that are found in the latter.
  bool counts = false;        ///< Too much to be two neighbours that merely shift.
};

/// Warm buffers of RelateRings.
struct RelationScratch {
  std::vector<CellShift> shift_before, shift_now;
  std::vector<std::int64_t> ways;
  std::vector<NodeRun> moved;
  std::vector<SharedNodes> shared;
  std::vector<std::uint32_t> newest;  // For FindSharedNodes.
  std::vector<std::uint64_t> nodes_before, nodes_now;
  std::vector<std::uint32_t> sample_count;  // By ring of the last frame.
  std::vector<std::uint64_t> told;          // By number: nodes that the samples account for.
  std::vector<std::uint8_t> linked_before, linked_now;
};

/// Finds the related rings (core/IDENTITIES.md): by the nodes that they share after rings
/// have gone the way of their samples, or else of their velocities, or where they are; and by
/// samples where these contradict. Relations come in no particular order, each pair once.
/// Cost: n log n in runs, rings and samples.
void RelateRings(const RingHistory& previous, const RingsNow& now, RelationScratch& scratch,
                 std::vector<RingRelation>& relations);

}  // namespace partiemc
