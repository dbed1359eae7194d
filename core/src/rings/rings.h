// Stage 4 of 9: segments -> closed rings, nested and cleaned.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "crossings/scanlines.h"
#include "frame/scale.h"
#include "partiemc/parameters.h"
#include "rings/components.h"

namespace partiemc {

/// Rings as sequences of segments, the inside on the left.
struct RingTopology {
  std::vector<std::uint32_t> segments;        ///< Indices of segments, ring after ring.
  std::vector<Point> entry_points;            ///< Where each of them enters its cell.
  std::vector<std::uint32_t> offsets;         ///< Ring k has segments [offsets[k], offsets[k + 1]).
  std::vector<std::uint32_t> outer_of;        ///< Per ring: its outer ring, or kNoRing.
  std::vector<std::uint64_t> particle_count;  ///< Per ring: of its component; 0 for holes.
  std::vector<double> particle_weight;  ///< The same for the field's weights, where they differ.
  Components components;                ///< Of the inside nodes: one for each outer ring.
  std::vector<std::uint32_t> component_of_ring;
  std::vector<std::uint32_t> outer_ring;  ///< By component.
  std::uint64_t dropped_holes = 0;
  std::uint64_t dropped_components = 0;
  std::uint64_t dropped_spray = 0;

  std::size_t RingCount() const { return outer_of.size(); }
};

/// Warm buffers of TraceRings.
struct RingScratch {
  std::vector<std::uint64_t> particle_count;
  std::vector<double> particle_weight;
  std::vector<std::uint32_t> next_segment;                   // kTaken once it belongs to a ring.
  std::vector<std::uint8_t> visited;                         // By ring.
  std::vector<std::pair<std::int64_t, std::int64_t>> edges;  // Row, column of the left node.
  std::vector<double> area;                                  // By ring, in cells.
  Scanlines rows;
  std::vector<std::uint32_t> outer_rings;  // From the outside inwards.
  std::vector<std::uint32_t> container;    // By outer ring: the one around it, or kNoRing.
  std::vector<std::uint64_t> enclosed;     // By outer ring: particles in it and in its islands.
  std::vector<std::uint8_t> dropped;       // By component.
};

/// Joins the segments of `crossings` to rings and assigns each hole to its outer ring. With
/// `parameters.clean`, components without a particle and holes below 2 h^2 (METHOD, Cleaning) are
/// dropped, with everything that lies in such a hole. Then spray is dropped: outer rings that
/// enclose less area than `min_component_area` h^2, or fewer particles than
/// `min_component_particles`, with everything in them. Nodes that were dropped change sides in
/// `crossings`. Areas are those of the level set's own isoline, before vertices are placed.
/// Rings come in the order of their first segments. Cost: linear in segments, tiles and particles.
/// Requires: resolved parameters.
void TraceRings(const ParticleBins& bins, const LevelSet& level_set, const Scale& scale,
                const ReconstructionParameters& parameters, Crossings& crossings,
                RingScratch& scratch, RingTopology& rings);

}  // namespace partiemc
