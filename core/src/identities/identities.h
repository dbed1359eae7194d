// Stage 7 of 9: rings of two frames -> identities and parents (core/IDENTITIES.md).
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
  std::vector<std::uint32_t> number;         // By ring of the topology, in the order of their runs.
  std::vector<std::uint32_t> topology_ring;  // By number.
  std::vector<std::uint32_t> ring_of_component;  // Number of its outer ring, or kNoRing.
  std::vector<std::uint64_t> particle_count;     // By number.
  std::vector<KnownRing> rings;                  // By number; their outer rings by number, too.
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
  const RingTopology& topology;
  const PlacedVertices& placed;
  double cell_size;
};

/// Gives every ring its identity and its parents, and writes to `next` what the next frame needs.
/// core/IDENTITIES.md has the rules; pairs that share equally many nodes go by the older identity,
/// then by the lower and the more left ring, and new identities by the lowest rows of their rings.
/// Depends on rings and particles as sets: not on their order or on threads.
/// Cost: linear in segments, rows of tiles and runs; n log n in rings and their relations; with ids
/// or velocities, that of FollowParticles.
void ContinueRings(const IdentityInput& input, const RingHistory& previous,
                   IdentityScratch& scratch, RingHistory& next, Rings& rings);

}  // namespace partiemc
