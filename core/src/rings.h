// Stage 4 of 7: segments -> closed rings, nested and cleaned.
#pragma once

#include <cstdint>
#include <vector>

#include "bins.h"
#include "components.h"
#include "crossings.h"
#include "scale.h"

namespace partiemc {

/// Rings as sequences of segments, the inside on the left.
struct RingTopology {
  std::vector<std::uint32_t> segments;        ///< Indices of segments, ring after ring.
  std::vector<std::uint32_t> offsets;         ///< Ring k has segments [offsets[k], offsets[k + 1]).
  std::vector<std::uint32_t> outer_of;        ///< Per ring: its outer ring, or kNoRing.
  std::vector<std::uint64_t> particle_count;  ///< Per ring: of its component; 0 for holes.
  std::uint64_t dropped_holes = 0;
  std::uint64_t dropped_components = 0;

  std::size_t RingCount() const { return outer_of.size(); }
};

/// Warm buffers of TraceRings.
struct RingScratch {
  Components components;
  std::vector<std::uint64_t> particle_count;
  std::vector<std::uint8_t> visited;
  std::vector<LatticePoint> points;
};

/// Joins the segments of `crossings` to rings and assigns each hole to its outer ring. With
/// `clean`, components without a particle and holes below 6 h^2 (METHOD, step 3) are dropped, with
/// everything that lies in such a hole; the nodes that they held then change sides in `crossings`.
/// Rings come in the order of their first segments. Cost: linear in segments and particles.
void TraceRings(const ParticleBins& bins, const LevelSet& level_set, const Scale& scale, bool clean,
                Crossings& crossings, RingScratch& scratch, RingTopology& rings);

}  // namespace partiemc
