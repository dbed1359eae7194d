// Stage 7 of 9: rings of two successive frames -> identities and parents (core/IDENTITIES.md).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "crossings/scanlines.h"
#include "identities/piece_relations.h"
#include "identities/relations.h"
#include "identities/ring_tracks.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "partiemc/state.h"
#include "periodic/frame_box.h"
#include "rings/percolation.h"
#include "rings/rings.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Scratch of ContinueRings. The kept rings of the frame have numbers from 0, in the order
/// of their first runs (NodeRun): by row, then column. Cut bodies without nodes in the box come
/// last.
struct IdentityScratch {
  Scanlines rows;
  std::vector<std::uint32_t> number;             // By ring of the topology.
  std::vector<std::uint32_t> topology_ring;      // By number.
  std::vector<std::uint32_t> ring_of_component;  // Number of the outer ring, or kNoRing.
  std::vector<std::uint64_t> particle_count;     // By number; 0: hole.
  std::vector<KnownRing> rings;                  // By number; `outer` is a number.
  RingTracks tracks;
  RingHistory carried;  // The last frame, moved with its box.
  RelationScratch<RingPieces> relation_scratch;
  std::vector<Relation> relations;
  std::vector<std::uint8_t> is_continued;  // By ring of the last frame.
  std::vector<std::uint32_t> continues;    // By number: ring of the last frame, or kNoIndex.
  std::vector<std::uint32_t> by_identity;  // Numbers, by ascending identity.
  std::vector<std::uint32_t> rank;         // By number: index in `by_identity`.
};

/// Results of the earlier stages.
struct IdentityInput {
  const Frame& frame;
  Plane plane;
  const ParticleBins& bins;
  const Crossings& crossings;
  const RingTopology& topology;
  const PlacedVertices& placed;
  double cell_size;  ///< World units.
  LatticePeriods periods = {};
  const Percolation* percolation = nullptr;  ///< Null: the frame has no copies.
  ParticleSubset subset = {};                ///< Other particles are ignored.
  /// Motion of the periodic box since the last frame, in cells, along the axes of the plane.
  BoxMotion box_motion = {};
  std::optional<PeriodicBox> box_to_store = std::nullopt;  ///< For RingHistory::box.
};

/// Assigns an identity and parents to every ring of `rings`, and writes `next`, the history for the
/// next frame (core/IDENTITIES.md). The result depends neither on the order of rings and particles
/// nor on the number of threads.
///
/// Ties: of pairs of rings that share the same number of nodes, the pair with the older identity
/// comes first, then the pair whose new ring has the lower number. New identities ascend with the
/// numbers of the rings (IdentityScratch).
/// Cost: linear in segments, rows of tiles and runs; n log n in rings and their relations; with ids
/// or velocities, also the cost of FollowParticles.
void ContinueRings(const IdentityInput& input, const RingHistory& previous,
                   IdentityScratch& scratch, RingHistory& next, Rings& rings);

}  // namespace partiemc
