// The result of a frame: rings, mesh and statistics.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "partiemc/attribute_values.h"
#include "partiemc/doubt.h"
#include "partiemc/surface.h"

namespace partiemc {

/// Marks an outer ring in Rings::outer_of.
inline constexpr std::uint32_t kNoRing = 0xffffffff;

struct RingMeasures {
  double area = 0;       ///< World units squared; positive for outer rings, negative for holes.
  double perimeter = 0;  ///< World units, without segments in Rings::cuts.
  double centroid_x = 0, centroid_y = 0;  ///< Centroid of the enclosed area, world units.
  std::uint64_t particle_count = 0;       ///< Particles of the component; 0 for holes.
  /// The ring that continues this ring in the next frame has the same identity. Distinct within a
  /// frame, never reused in a stream (core/IDENTITIES.md).
  std::uint64_t identity = 0;  ///< 0: not tracked.

  friend bool operator==(const RingMeasures&, const RingMeasures&) = default;
};

/// Closed polylines. Guarantees if KeepsGuarantees(placement) (core/METHOD.md, "Guarantees"):
///   R1 every ring has at least 3 points, all finite and different (closed, so the first point is
///      not repeated at the end);
///   R2 rings are simple and do not touch each other;
///   R3 the inside is on the left: outer rings counter-clockwise, holes clockwise;
///   R4 each hole lies inside the outer ring that `outer_of` gives.
struct Rings {
  std::vector<double> points;                ///< x0, y0, x1, y1, ... in world units.
  std::vector<std::uint32_t> offsets = {0};  ///< Ring k has points [offsets[k], offsets[k + 1]).
  std::vector<std::uint32_t> outer_of;       ///< Per ring: its outer ring, or kNoRing.
  std::vector<RingMeasures> measures;        ///< Per ring.
  std::vector<float> normals;                ///< Per point: outward unit normal, interleaved.
  /// Parents of ring k, [parent_offsets[k], parent_offsets[k + 1]): the identities, ascending, of
  /// the rings of the last frame that ring k continues. A new ring has no parent, a ring after a
  /// merge has several. After a split, several rings have the same parent.
  std::vector<std::uint64_t> parents;
  std::vector<std::uint32_t> parent_offsets = {0};  ///< Like `offsets`; {0} without identities.
  /// Indices of points, ascending, whose segment to the next point of the ring lies on a face of
  /// the periodic box, where a body was cut (ReconstructionParameters::box).
  std::vector<std::uint32_t> cuts;
  /// Indices of points, ascending, whose segment to the next point of the ring lies on a wall
  /// (ReconstructionParameters::walls, wall_phases). Where rings crossed, their repair may have
  /// moved an end of this segment off the wall.
  std::vector<std::uint32_t> wetted;
  /// Indices of points, ascending, where an outline meets a wall, or where a phase meets two other
  /// phases, or one and the outside (core/PHASES.md). Junctions of phases whose angle cannot be
  /// measured are not listed. `contact_angles` has one angle per contact, of the fluid or of the
  /// phase, in radians, in [0, 2 pi].
  std::vector<std::uint32_t> contacts;
  std::vector<float> contact_angles;

  std::size_t RingCount() const { return outer_of.size(); }
  std::size_t PointCount() const { return points.size() / 2; }
  std::span<const double> RingPoints(std::size_t ring) const {
    return std::span(points).subspan(2 * std::size_t{offsets[ring]},
                                     2 * std::size_t{offsets[ring + 1] - offsets[ring]});
  }
  std::span<const std::uint64_t> ParentsOf(std::size_t ring) const {
    if (ring + 1 >= parent_offsets.size()) return {};
    return std::span(parents).subspan(parent_offsets[ring],
                                      parent_offsets[ring + 1] - parent_offsets[ring]);
  }
  void Clear();
  friend bool operator==(const Rings&, const Rings&) = default;
};

enum class TriangleClass : std::uint8_t {
  kBoundary,  ///< In the band between the rings and the interior cells.
  kInterior,  ///< Part of one interior cell or of several merged ones.
};

/// Triangles that cover the inside of the rings. Guarantees if KeepsGuarantees(placement):
///   M1 every triangle is counter-clockwise, none is folded or degenerate;
///   M2 triangles do not overlap and together cover exactly the inside of the rings;
///   M3 the first points of the mesh are the points of the rings, bit for bit, in their order;
///   M4 no vertex lies on a side of a triangle or ring between the ends of the side. Only for
///      Fill::kConforming, kPolygon, and kGreedy with blocks (attribute_tolerance).
struct Mesh {
  std::vector<double> points;            ///< x0, y0, x1, y1, ... in world units.
  std::vector<std::uint32_t> triangles;  ///< Three point indices each.
  std::vector<TriangleClass> classes;    ///< Per triangle.

  std::size_t PointCount() const { return points.size() / 2; }
  std::size_t TriangleCount() const { return classes.size(); }
  void Clear();
  friend bool operator==(const Mesh&, const Mesh&) = default;
};

struct FrameStatistics {
  std::uint64_t particles = 0;  ///< Wall particles do not count.
  /// Tiles of 32 x 32 nodes that were allocated; for surfaces, bricks of 8 x 8 x 8 nodes.
  std::uint64_t tiles = 0;
  std::uint64_t active_cells = 0;        ///< Cells that the outline crosses; 0 for surfaces.
  std::uint64_t dropped_holes = 0;       ///< Holes that cleaning closed; for surfaces, cavities.
  std::uint64_t dropped_components = 0;  ///< Components without a particle that cleaning removed.
  /// Components that were removed because they are smaller than `min_component_area`,
  /// `min_component_particles` or, for surfaces, `min_component_volume`.
  std::uint64_t dropped_spray = 0;
  /// Bodies that were cut at faces of the periodic box, because they percolate or because they are
  /// long and near a body that does (core/PERIODIC.md).
  std::uint64_t cut_bodies = 0;
  std::uint64_t triangles = 0;           ///< Triangles of the mesh or of the surface.
  std::uint64_t triangles_grid = 0;      ///< Triangles of a mesh by Fill::kGrid of the same rings.
  std::uint64_t self_intersections = 0;  ///< Pairs of segments of rings that cross or touch. Only
                                         ///< counted for Placement::kFarthestParticle, else 0.
  std::uint64_t folded_triangles = 0;    ///< Triangles that are clockwise or degenerate. Only
                                         ///< counted for Placement::kFarthestParticle, else 0.
  double area = 0;  ///< World units squared. Sum of signed ring areas; surfaces: of shell areas.
  double perimeter = 0;  ///< Sum over rings, world units; 0 for surfaces.
  double volume = 0;     ///< Sum of signed shell volumes, world units cubed; 0 for outlines.
  double spacing = 0;    ///< Spacing used in this frame, world units; 0: unknown.
  double cell_size = 0;  ///< Lattice spacing, world units. Constant in a stream, except in frames
                         ///< with Doubt::kSpacingProvisional.
  Doubts doubts;         ///< Reasons to distrust the result.

  friend bool operator==(const FrameStatistics&, const FrameStatistics&) = default;
};

/// Output::kOutline leaves `surface` empty. Output::kSurface leaves `rings`, `mesh` and
/// `attributes` empty; the attributes are in `surface`.
struct Result {
  Rings rings;
  Mesh mesh;  ///< Empty for Fill::kNone.
  Surface surface;
  std::vector<AttributeValues> attributes;  ///< In the order of Frame::attributes, without phases.
  FrameStatistics statistics;
  /// The results of ReconstructionParameters::sections. Each is the same as if its outline were the
  /// only one, except that phases divide the outline of the stream (Section::phase).
  std::vector<Result> sections;

  /// Empties everything, except that `attributes` keep their names and components. The elements of
  /// `sections` remain and are cleared in the same way.
  void Clear();
  friend bool operator==(const Result&, const Result&) = default;
};

/// 64-bit digests of the points and of rings, shells and triangles with their nesting and classes.
/// Normals, measures and attributes are left out. Equal digests mean equal bits, except for
/// collisions. proto/PROTOCOL.md defines the digests, so that any client can compute them.
std::uint64_t DigestRings(const Rings& rings);
std::uint64_t DigestMesh(const Mesh& mesh);
std::uint64_t DigestSurface(const Surface& surface);

struct OutlineDigests {
  std::uint64_t rings = 0, mesh = 0;

  friend bool operator==(const OutlineDigests&, const OutlineDigests&) = default;
};

/// The digests of each section of a result.
std::vector<OutlineDigests> DigestSections(const Result& result);

}  // namespace partiemc
