// Stage 6 of 9: cell planes -> vertices of the rings (paper, sections 3.4-3.5).
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
#include "vertices/periodic_ring.h"
#include "vertices/repair.h"

namespace partiemc {

struct VirtualPlaneVariant;  // core/internal/research.h

/// Marks a segment whose ring was dropped in PlacedVertices::point_of_segment.
inline constexpr std::uint32_t kNoPoint = 0xffffffff;

/// How the points of Rings belong to the rings of RingTopology and their segments.
struct PlacedVertices {
  /// Per segment: index in Rings::points of the vertex of its cell (of its entry crossing for
  /// `marching-squares`), or kNoPoint.
  std::vector<std::uint32_t> point_of_segment;
  std::vector<std::uint32_t> kept_as;  ///< Per ring: its index in Rings, or kNoRing.
  /// `virtual-plane` only: where each point of the rings may retreat to, interleaved, in world
  /// units.
  std::vector<double> roots;
  std::uint64_t self_intersections = 0;  ///< Of placements that do not promise to have none.
};

/// Unit, outward.
struct VertexNormal {
  float x = 0, y = 0;
};

/// Two vertices per segment of the topology, ring after ring: the crossing of its entry edge, then
/// the vertex of its cell. Lengths in cells, positions in lattice coordinates of the world. Segment
/// k has vertices 2 k and 2 k + 1.
struct RingVertices {
  std::vector<Point> point;
  /// Where a vertex may always retreat to: with all vertices there, rings are simple.
  std::vector<Point> root;
  std::vector<VertexNormal> normal;
  std::vector<std::uint8_t> is_kept;  ///< 0 for vertices that thinning dropped.
  PeriodicRings periodic_rings;       ///< Scratch of the steps.

  void Resize(std::size_t count) {
    point.resize(count);
    root.resize(count);
    normal.resize(count);
    is_kept.resize(count);
  }
};

/// Warm buffers of PlaceVertices.
struct VertexScratch {
  std::vector<double> points;  ///< One or two per segment, in world units, before duplicates go.
  RingVertices vertices;       ///< Of `virtual-plane`, on their way.
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
  const VirtualPlaneVariant& variant;
  const Scale& scale;
};

/// Places the vertices of every ring and measures the rings.
///   marching-squares   the crossings of lattice edges, by linear interpolation of F;
///   qef                those, and in each cell the minimiser of Eq. 14, kept in the cell;
///   virtual-plane      one vertex per cell and crossed edge, moved to the plane that its
///                      surroundings support (virtual_plane.h), matched to the particles' area
///                      (volume_correction.h) and repaired (repair.h).
/// marching-squares and qef keep every vertex in its cell or on its edge, so that rings are simple
/// by construction (core/METHOD.md, "Why rings are simple"); virtual-plane may leave the cells and
/// is simple by its repair. Placements that take particles as vertices (placement_traits.h) drop
/// consecutive equal vertices, and rings with fewer than three points left.
/// `area_offset`: of `virtual-plane`, that of the last frame, then of this one
/// (volume_correction.h). Returns false if the repair failed, which is a bug.
/// Deterministic, in parallel over segments. Cost: linear in segments and the particles near them.
[[nodiscard]] bool PlaceVertices(const VertexInput& input, std::optional<double>& area_offset,
                                 VertexScratch& scratch, PlacedVertices& placed, Rings& rings);

}  // namespace partiemc
