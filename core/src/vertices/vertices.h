// Stage 6 of 9: cell planes -> vertices of the rings (paper, sections 3.4-3.5).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "normals/normals.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "rings/percolation.h"
#include "rings/rings.h"
#include "sampler/level_set_sampler.h"
#include "vertices/periodic_ring.h"
#include "vertices/repair.h"
#include "vertices/wall_vertices.h"
#include "walls/wall_field.h"

namespace partiemc {

struct VirtualPlaneVariant;  // core/internal/research.h

/// Value of PlacedVertices::point_of_segment for a segment whose ring or vertex was dropped.
inline constexpr std::uint32_t kNoPoint = 0xffffffff;

/// Maps rings and segments of RingTopology to rings and points of Rings.
struct PlacedVertices {
  /// By segment: its cell's vertex, for `marching-squares` its entry crossing, as an index of a
  /// point of Rings; or kNoPoint.
  std::vector<std::uint32_t> point_of_segment;
  std::vector<std::uint32_t> kept_as;  ///< By ring of the topology: its index in Rings, or kNoRing.
  /// The anchor of each point, to which the repair may move it; interleaved, in world units. Empty
  /// except for `virtual-plane`.
  std::vector<double> roots;
  /// Set by CutRings (cut/ring_cut.h) in frames with copies of particles, else empty. By ring of
  /// Rings: the outer ring of its component in the topology.
  std::vector<std::uint32_t> group_of_ring;
  /// Pairs of segments that touch; 0 for placements that guarantee simple rings.
  std::uint64_t self_intersections = 0;
};

/// A unit normal, pointing outward.
struct VertexNormal {
  float x = 0, y = 0;
};

/// A point of a free stretch between walls, or of its continuation beyond a wall.
struct StretchPoint {
  Point point;  ///< In cells from the origin of the world.
  VertexNormal normal;
  float size;          ///< The local size, in spacings; 1 for equal sizes.
  std::size_t vertex;  ///< Index in RingVertices; kNoVertex beyond a wall.
};
inline constexpr std::size_t kNoVertex = ~std::size_t{0};

/// Vertices of `virtual-plane`, ring by ring. Segment k of the topology has two vertices: 2 k on
/// the edge where it enters its cell, and 2 k + 1 in the cell. Positions are in cells from the
/// origin of the world.
struct RingVertices {
  std::vector<Point> point;
  std::vector<Point> root;  ///< The anchor: with all vertices at their anchors, rings are simple.
  std::vector<VertexNormal> normal;
  std::vector<float> size;            ///< The local size, in spacings; empty for equal sizes.
  std::vector<std::uint8_t> is_kept;  ///< 0 if thinning dropped the vertex.
  PeriodicRings periodic_rings;       ///< Scratch of the steps.
  WallVertices walls;
  std::vector<std::uint8_t> meets_wall;  ///< By ring; unused without walls.
  std::vector<StretchPoint> stretch;     ///< Scratch of the stretches between walls.
  std::vector<Point> stretch_path;       ///< Scratch: the points of `stretch`, there and back.
  std::vector<float> stretch_sizes;      ///< Scratch: their local sizes; empty for equal sizes.

  double SizeOf(std::size_t vertex) const { return size.empty() ? 1.0 : double{size[vertex]}; }

  void Resize(std::size_t count, bool has_sizes) {
    size.resize(has_sizes ? count : 0);
    point.resize(count);
    root.resize(count);
    normal.resize(count);
    is_kept.resize(count);
  }
};

/// Warm buffers of PlaceVertices.
struct VertexScratch {
  std::vector<double> points;  ///< One or two for each segment; not for `virtual-plane`.
  RingVertices vertices;       ///< `virtual-plane` only.
  WallVertices walls;          ///< By point of the rings, if there are walls.
  bool has_walls = false;
  std::vector<std::uint8_t> near_walls;  ///< By point: 1 near a wall; empty without walls.
  std::vector<float> sizes;              ///< By point: the local size; empty for equal sizes.
  std::vector<float> offset_factors;     ///< By point, if rings meet walls (PointSizes::factors).
  std::vector<double> offset_points;     ///< Scratch of CorrectVolume.
  RepairScratch repair;

  /// By point of the rings; null without walls.
  const WallVertices* WallPoints() const { return has_walls ? &walls : nullptr; }
};

/// The frame, the parameters and the results of the earlier stages.
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
  const Percolation* percolation = nullptr;  ///< Null without copies of particles.
  const WallField* walls = nullptr;          ///< Null without walls.
};

/// Places the vertices of every ring and measures the rings.
///   - marching-squares: a vertex at the crossing of each crossed lattice edge.
///   - qef: these vertices, and in each cell the minimiser of Eq. 14, clamped to the cell.
///   - farthest-particle: a particle for each segment (normals/farthest_particle.h).
///   - virtual-plane: a vertex for each cell and crossed edge, moved to a plane that particles
///     support (virtual_plane.h). The rings are then matched to the area of the particles
///     (volume_correction.h) and repaired (repair.h).
///
/// The rings of marching-squares and qef are simple because each vertex stays in its cell or on its
/// edge (core/METHOD.md, "Why rings are simple"). Vertices of virtual-plane may leave their cells;
/// the repair makes the rings simple. farthest-particle drops consecutive equal vertices, and then
/// rings with fewer than three points.
///
/// `area_offset`, used by virtual-plane only, is the offset of the last frame and becomes the
/// offset of this frame (volume_correction.h). Returns false if the repair failed, which is a bug.
/// Deterministic. Parallel over segments and rings.
/// Cost: near-linear in segments and the particles near them.
[[nodiscard]] bool PlaceVertices(const VertexInput& input, std::optional<double>& area_offset,
                                 VertexScratch& scratch, PlacedVertices& placed, Rings& rings);

}  // namespace partiemc
