// Which ring of the last frame a ring continues: the end of stage 6, when it is known which rings
// there are.
#pragma once

#include <cstdint>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "crossings/scanlines.h"
#include "identities/ring_relations.h"
#include "identities/ring_tracks.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "partiemc/state.h"
#include "rings/rings.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Warm buffers of ContinueRings.
struct IdentityScratch {
  Scanlines rows;
  std::vector<std::uint32_t> result_ring;    // By ring of the topology; kNoRing: it was dropped.
  std::vector<std::uint32_t> number;         // By ring of the topology, in the order of their runs.
  std::vector<std::uint32_t> topology_ring;  // By number.
  std::vector<std::uint32_t> outer;          // By number: that of a hole's outer ring, or kNoRing.
  std::vector<std::uint32_t> ring_of_component;  // Number of its outer ring, or kNoRing.
  std::vector<std::uint64_t> particle_count;     // By number.
  std::vector<std::uint64_t> identity;           // By number.
  std::vector<std::uint8_t> is_hole;             // By number.
  RingTracks tracks;
  RelationScratch relation_scratch;
  std::vector<RingRelation> relations;
  std::vector<std::uint8_t> is_continued;  // By ring of the last frame.
  std::vector<std::uint32_t> by_identity;  // Numbers.
  std::vector<std::uint32_t> rank;         // By number: place of its identity.
};

/// What the stages before tell of the rings.
struct IdentityInput {
  const Frame& frame;
  Plane plane;
  const ParticleBins& bins;
  const Crossings& crossings;
  const RingScratch& traced;
  const RingTopology& topology;
  const PlacedVertices& placed;
  double cell_size;
};

/// Gives every ring its identity and its parents, and writes to `next` what the next frame needs.
///
/// A ring stands for nodes: an outer ring for the inside nodes of its component, a hole for the
/// nodes of its void on rows where they are next to the hole's ring. Rings of two frames, both
/// outer or both holes, are related where they share nodes, after they have moved as their
/// particles tell, or where ids show that particles went from one to the other (RelateRings), and
///   - at least a quarter of the nodes of the smaller of the two, or
///   - neither is related to any other by that rule.
/// Parents are the related rings of the frame before. An identity goes to the related ring that
/// shares most, pairs being taken in the order of the nodes that they share (equal numbers: the
/// older identity, then the lower and the more left ring). Other rings get new identities, in the
/// order of their lowest rows.
///
/// So a ring that keeps some of its place keeps its identity, and one that leaves it does where its
/// particles have ids or right velocities; one that is missing from a frame is new. Depends on
/// nothing but rings and particles as sets: not on their order or on threads.
/// Cost: linear in segments, rows of tiles and runs; n log n in rings and their relations; with ids
/// or velocities, that of FollowParticles.
void ContinueRings(const IdentityInput& input, const RingHistory& previous,
                   IdentityScratch& scratch, RingHistory& next, Rings& rings);

}  // namespace partiemc
