// Which ring of the last frame a ring continues: the end of stage 6, when it is known which rings
// there are.
#pragma once

#include <cstdint>
#include <vector>

#include "crossed_rows.h"
#include "crossings.h"
#include "lattice.h"
#include "partiemc/result.h"
#include "partiemc/state.h"
#include "rings.h"
#include "vertices.h"

namespace partiemc {

/// `nodes` that a ring of the last frame and one of this frame share.
struct RingOverlap {
  std::uint32_t before = 0, now = 0;
  std::uint64_t nodes = 0;
  bool counts = false;  ///< Too much to be two neighbours that merely shift.
};

/// Warm buffers of ContinueRings.
struct IdentityScratch {
  CrossedRows rows;
  std::vector<std::uint32_t> result_ring;    // By ring of the topology; kNoRing: it was dropped.
  std::vector<std::uint32_t> number;         // By ring of the topology, in the order of their runs.
  std::vector<std::uint32_t> topology_ring;  // By number.
  std::vector<std::uint64_t> identity;       // By number.
  std::vector<std::uint64_t> nodes_before, nodes_now;
  std::vector<std::uint8_t> is_hole;  // By number.
  std::vector<std::uint8_t> linked_before, linked_now;
  std::vector<RingOverlap> overlaps;
  std::vector<std::uint32_t> rank;  // By number: place of its identity.
};

/// Gives every ring its identity and its parents, and writes to `next` what the next frame needs.
///
/// A ring stands for nodes: an outer ring for the inside nodes of its component, a hole for the
/// nodes of its void on rows where they are next to the hole's ring. Rings of two frames, both
/// outer or both holes, are related where they share nodes, and
///   - at least a quarter of the nodes of the smaller of the two, or
///   - neither is related to any other by that rule.
/// Parents are the related rings of the frame before. An identity goes to the related ring that
/// shares most nodes, pairs being taken in the order of the nodes that they share (equal numbers:
/// the older identity, then the lower and the more left ring). Other rings get new identities, in
/// the order of their lowest rows.
///
/// So a ring that keeps some of its place keeps its identity; one that leaves its place
/// within a frame, or is missing from one, is new. Depends on nothing but the rings as sets: not on
/// their order, on particles' order or on threads.
/// Cost: linear in segments, rows of tiles and runs; n log n in rings and their overlaps.
void ContinueRings(const TileDirectory& directory, const Crossings& crossings,
                   const RingTopology& topology, const PlacedVertices& placed,
                   const RingHistory& previous, IdentityScratch& scratch, RingHistory& next,
                   Rings& rings);

}  // namespace partiemc
