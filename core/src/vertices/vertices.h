// Stage 6 of 7: cell planes -> vertices of the rings (paper, sections 3.4-3.5).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "normals/normals.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "rings/rings.h"
#include "sampler/level_set_sampler.h"
#include "vertices/repair.h"
#include "vertices/ring_vertices.h"

namespace partiemc {

/// Marks a segment whose ring was dropped in PlacedVertices::point_of_segment.
inline constexpr std::uint32_t kNoPoint = 0xffffffff;

/// Warm buffers of PlaceVertices, and how its points belong to segments.
struct PlacedVertices {
  std::vector<double> points;  ///< One or two per segment, in world units, before duplicates go.
  /// Per segment of RingTopology: index in Rings::points of the vertex of its cell (of its entry
  /// crossing for `marching-squares`), or kNoPoint.
  std::vector<std::uint32_t> point_of_segment;
  std::vector<std::uint32_t>
      kept_as;  ///< Per ring of RingTopology: its index in Rings, or kNoRing.
  /// `virtual-plane` only: the vertices on their way, and where each point of the rings may retreat
  /// to, interleaved, in world units.
  RingVertices vertices;
  std::vector<double> roots;
  std::vector<double> offset_points;
  RepairScratch repair;
};

/// What the placements need of the stages before.
struct VertexInput {
  const Frame& frame;
  const ParticleBins& bins;
  const LevelSet& level_set;
  const Crossings& crossings;
  const RingTopology& topology;
  const LevelSetSampler& field;
  const std::vector<CellPlane>& planes;
  const ReconstructionParameters& parameters;
  const Scale& scale;
};

/// Places the vertices of every ring and measures the rings.
///   marching-squares   the crossings of lattice edges, by linear interpolation of F;
///   qef                those, and in each cell the minimiser of Eq. 14, kept in the cell;
///   farthest-particle  section 3.5: the particle farthest along the normal, one cell around;
///   virtual-plane      one vertex per cell and crossed edge, moved to the plane that its
///                      surroundings support (virtual_plane.h), matched to the particles' area
///                      (area.h) and repaired (repair.h).
/// marching-squares and qef keep every vertex in its cell or on its edge, so that rings are simple
/// by construction (core/METHOD.md, "Why rings are simple"); virtual-plane may leave the cells and
/// is simple by its repair. farthest-particle drops consecutive equal vertices, and rings of which
/// fewer than three points remain.
/// `area_offset`: of `virtual-plane`, that of the last frame, then of this one (area.h).
/// Deterministic, in parallel over segments. Cost: linear in segments and the particles near them.
void PlaceVertices(const VertexInput& input, std::optional<double>& area_offset,
                   PlacedVertices& placed, Rings& rings);

}  // namespace partiemc
