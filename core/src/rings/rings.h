// Stage 4 of 9: joins segments to closed rings, nests and cleans them.
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

/// Rings as sequences of segments with the inside on the left.
struct RingTopology {
  std::vector<std::uint32_t> segments;  ///< Indices of segments, ring by ring.
  std::vector<Point> entry_points;      ///< Like `segments`: where each enters its cell, in cells.
  std::vector<std::uint32_t> offsets;   ///< Ring k has segments [offsets[k], offsets[k + 1]).
  std::vector<std::uint32_t> outer_of;  ///< Per ring: a hole's outer ring, else kNoRing.
  std::vector<std::uint64_t> particle_count;  ///< Per ring: particles of its component; 0: hole.
  std::vector<double> particle_weight;        ///< Per ring: summed weight of the particles of its
                                              ///< component; 0: hole, or uniform weights.
  Components components;                      ///< Of inside nodes; each has one outer ring.
  std::vector<std::uint32_t> component_of_ring;
  std::vector<std::uint32_t> outer_ring;  ///< By component.
  std::uint64_t dropped_holes = 0;
  std::uint64_t dropped_components = 0;
  std::uint64_t dropped_spray = 0;

  std::size_t RingCount() const { return outer_of.size(); }
};

/// Scratch of TraceRings.
struct RingScratch {
  std::vector<std::uint64_t> particle_count;
  std::vector<double> particle_weight;
  std::vector<std::uint32_t> next_segment;  // By segment; kTaken: already in a ring.
  std::vector<std::uint8_t> visited;        // By ring.
  std::vector<std::pair<std::int64_t, std::int64_t>> edges;  // Of a hole: row, left column.
  std::vector<double> area;                                  // By ring, in squared cells.
  Scanlines rows;
  std::vector<std::uint32_t> outer_rings;  // Each after the outer ring around it.
  std::vector<std::uint32_t> container;    // By outer ring: the outer ring around it, or kNoRing.
  std::vector<std::uint64_t> enclosed;     // By outer ring: particles in it and its islands.
  std::vector<std::uint8_t> dropped;       // By component.
};

/// Joins the segments of `crossings` to rings, in the order of their first segments, and assigns
/// each hole to its outer ring. Requires: resolved parameters.
/// - `parameters.clean`: drops components without particles, and holes below 2 h^2 (.5 h^2 around
///   grains) with everything in them (core/METHOD.md, "Cleaning").
/// - `min_component_area`, `min_component_particles`: then, also without `clean`, drops outer rings
///   that enclose less area (in h^2) or fewer particles, with everything in them, unless
///   `keeps_spray`.
/// In `crossings`, the nodes of a dropped component become outside, and the nodes of a dropped hole
/// inside. Areas are measured on the level set, before vertices are placed. Cost: linear in
/// segments, tiles and particles.
void TraceRings(const ParticleBins& bins, const LevelSet& level_set, const Scale& scale,
                const ReconstructionParameters& parameters, Crossings& crossings,
                RingScratch& scratch, RingTopology& rings, bool keeps_spray = false);

/// The signed area of a ring through its edge crossings, in squared cells.
double AreaOfRing(const RingTopology& rings, std::size_t ring);

}  // namespace partiemc
