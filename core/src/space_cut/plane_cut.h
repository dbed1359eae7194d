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

#include "mesh/triangulate.h"
#include "simplify/mesh_faults.h"
#include "space_cut/cap_squares.h"
#include "space_cut/cut_mesh.h"

namespace partiemc::space {

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
  CapSquares squares;
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

/// Triangulates the caps and checks that no clipped triangle is degenerate or
/// intersects another triangle. All of this is exact. If the mesh had the guarantees S1 to S3 of
/// partiemc/surface.h before the cuts, it has them afterwards:
///   - one edge arrives at each point of a cap, and one leaves, so caps are flat and simple, and
///     touch each other only in common edges;
///   - all other points are strictly on the kept side, so other triangles touch a plane only with
///     edges and points of the cap;
///   - clipped triangles are compared with all triangles near them.
/// Caps get inner points on a lattice with this `step` (cap_squares.h), or none if it is 0.
/// Returns false, with `mesh` in any state, if a check fails. Cost: n log n in clipped triangles,
/// triangles near the planes, and points of the caps.
[[nodiscard]] bool CapPlanes(double step, PlaneCutScratch& scratch, CutMesh& mesh);

}  // namespace partiemc::space
