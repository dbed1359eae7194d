// Cuts closed triangle surfaces at planes parallel to the coordinate planes.
//
// Order of calls: fill a CutMesh, call CutAtPlane for each plane, then CapPlanes. Each call may
// return false, because rounding leaves a decision open. Then move the planes a little and begin
// again with the uncut mesh. surface_cut.h does this for a Surface.
//
// Caps stay polygons until all planes have cut the mesh. A plane therefore crosses the edges of an
// earlier cap, never its triangles, which may be as thin as rounding.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "mesh/triangulate.h"
#include "simplify/mesh_faults.h"

namespace partiemc::space {

/// A plane parallel to two axes, and the side on which points are kept.
struct AxisPlane {
  int axis = 0;  ///< The coordinate that is constant on the plane: 0, 1, 2 for x, y, z.
  double at = 0;
  bool keeps_above =
      true;  ///< Whether points with a larger coordinate are kept, else smaller ones.
};

/// A closed surface: triangles, counter-clockwise as seen from outside, and caps on the planes that
/// have cut it.
struct CutMesh {
  /// An edge of a cap. The cap is on its left, seen from outside of the body.
  struct CapEdge {
    std::uint32_t from, to;
    std::uint32_t shell;  ///< A number as in CutMesh::shell_of.
  };
  struct Cap {
    AxisPlane plane;
    std::vector<CapEdge> edges;
  };
  std::vector<double> points;            ///< x0, y0, z0, x1, ...; may hold unused points.
  std::vector<float> normals;            ///< Per point, interleaved.
  std::vector<std::uint32_t> triangles;  ///< Three point indices each.
  std::vector<std::uint32_t> shell_of;   ///< Per triangle: any number; its parts get the same.
  std::vector<std::uint8_t> is_clipped;  ///< Per triangle: 1 if it is a part of a cut triangle.
  std::vector<Cap> caps;                 ///< One for each plane, in the order of the calls.
  /// Set by CapPlanes: cap k has the triangles [cap_offsets[k], cap_offsets[k + 1]), after all
  /// triangles of no cap. CutSurface then appends shells that are not cut, and drops dust. After
  /// that, only cap_offsets[0] is valid.
  std::vector<std::uint32_t> cap_offsets;
};

/// Warm buffers.
struct PlaneCutScratch {
  struct Edge {
    std::uint32_t low, high;  // Points, low < high.
    friend auto operator<=>(const Edge&, const Edge&) = default;
  };
  struct Crossing {
    double along;
    std::uint32_t point, shell;
    bool is_entry;
  };
  std::vector<std::int8_t> side;  // By point: 1 kept, -1 cut off, 0 too close to the plane.
  std::vector<Edge> edges;        // The crossed ones, sorted.
  std::vector<Crossing> crossings;
  std::vector<std::uint32_t> triangles, shell_of;
  std::vector<std::uint8_t> is_clipped;
  std::vector<CutMesh::CapEdge> cap_edges, line_edges;
  std::vector<std::vector<CutMesh::CapEdge>> spare_edges;  // Of earlier caps.
  // Used by CapPlanes only.
  struct Layer {  // The range along the plane's axis of the clipped triangles at the plane.
    AxisPlane plane;
    double low, high;
  };
  std::vector<Layer> layers;
  std::vector<std::uint32_t> near;
  std::vector<std::uint8_t> is_new;
  TriangleGrid grid;
  std::vector<simplify::Contact> contacts;
  std::vector<std::uint32_t> point_of, next, loop_points, loop_offsets, flat_triangles;
  std::vector<std::array<double, 2>> places;
  std::vector<double> flat_points;
  Triangulator triangulator;
};

/// Removes the caps, but keeps their memory.
void RemoveCaps(PlaneCutScratch& scratch, CutMesh& mesh);

/// Replaces the mesh by its part on the kept side of the plane, and adds a cap without triangles to
/// `mesh.caps`. Crossed edges get new points, exactly on the plane. Their other coordinates are
/// rounded, but lie between the ends of the edge. Their normals are interpolated.
///
/// A triangle becomes one or two triangles, or is dropped. Where the plane crosses an earlier cap,
/// inside and outside alternate along the common line of both planes. Each stretch inside becomes
/// an edge of both caps.
///
/// Returns false, with `mesh` in any state, if a point is less than `clearance` from the plane.
/// Also if rounding breaks the alternation, or moves a new point onto another plane. Requires: the
/// mesh is closed and its coordinates are in the domain of predicates_in_space.h; planes with the
/// same axis are different. Deterministic. Cost: linear in triangles, n log n in crossed edges.
[[nodiscard]] bool CutAtPlane(const AxisPlane& plane, double clearance, PlaneCutScratch& scratch,
                              CutMesh& mesh);

/// Triangulates the caps, without new points, and checks that no clipped triangle is degenerate or
/// intersects another triangle. All of this is exact. If the mesh had the guarantees S1 to S3 of
/// partiemc/surface.h before the cuts, it has them afterwards:
///   - one edge arrives at each point of a cap, and one leaves, so caps are flat and simple, and
///     touch each other only in common edges;
///   - all other points are strictly on the kept side, so other triangles touch a plane only with
///     edges and points of the cap;
///   - clipped triangles are compared with all triangles near them.
/// Returns false, with `mesh` in any state, if a check fails. Cost: n log n in clipped triangles,
/// triangles near the planes, and points of the caps.
[[nodiscard]] bool CapPlanes(PlaneCutScratch& scratch, CutMesh& mesh);

}  // namespace partiemc::space
