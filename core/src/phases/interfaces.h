// The interfaces between phases: their points, arcs and smoothing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/internal/research.h"
#include "frame/scale.h"
#include "phases/phase_field.h"
#include "phases/phase_map.h"
#include "phases/phase_rings.h"
#include "vertices/periodic_ring.h"
#include "vertices/vertices.h"

namespace partiemc {

/// A piece of an interface, with one phase on its left and a phase of a larger label on its right.
struct PhaseArc {
  static constexpr std::uint32_t kNoEnd = 0xffffffff;

  std::uint32_t first = 0, last = 0;  ///< Its inner points are Interfaces::points[first, last).
  std::uint32_t start = kNoEnd, end = kNoEnd;  ///< Shared points; kNoEnd: a closed arc.
  PhaseLabel left = 0, right = 0;
  /// Connected components of these two phases (PhaseRings::topology).
  std::uint32_t left_component = 0, right_component = 0;

  bool IsClosed() const { return start == kNoEnd; }
};

/// Positions of shared points (PointNumbers), in cells from the origin of the world.
struct SharedPoints {
  std::vector<Point> position;
  std::vector<Point> anchor;  ///< With all points at their anchors, the outlines are valid.
  /// Unit normals. At points of the body: outward. On edges: from the phase with the lower label to
  /// the phase with the higher one. At points of cells (PhaseCell): 0, until SmoothInterfaces
  /// copies the normal of a neighbour; at junctions always 0.
  std::vector<VertexNormal> normal;
};

struct Interfaces {
  std::vector<PhaseArc> arcs;
  std::vector<std::uint32_t> points;  ///< Numbers of shared points.
  PeriodicRings rings;                ///< Scratch of SmoothInterfaces.
  std::vector<Point> ring;            ///< Scratch of SmoothInterfaces.

  std::span<const std::uint32_t> InnerPoints(const PhaseArc& arc) const {
    return std::span(points).subspan(arc.first, arc.last - arc.first);
  }
};

/// Sets the points of edges and cells. The point of an edge is where the phases of its nodes have
/// equal g (PhaseField), but at least kEdgeMargin cells away from the nodes. It is the middle of
/// the edge unless at each node the phase of this node has the larger g. The point of a junction's
/// cell is the middle, of another cell halfway from the vertex of the body to PhaseCell::corner.
/// Requires: the body's points are set. Parallel over edges. Cost: six kernel sums for each edge.
void FindInterfacePoints(const TileDirectory& directory, const PhaseMap& map,
                         const PhaseField& field, const PointNumbers& numbers,
                         const BodyVertices& vertices, SharedPoints& points);

/// Collects the arcs. `phases`: by label less one. Cost: linear in points.
void CollectArcs(const TileDirectory& directory, const PhaseMap& map, const PointNumbers& numbers,
                 std::span<const PhaseRings> phases, Interfaces& interfaces);

/// Smooths the arcs, and their normals, as steps 2 and 3 of the default placement smooth rings
/// (core/METHOD.md), but without the support of particles. A closed arc is smoothed as a ring. An
/// open arc continues beyond a straight end with its own points in reverse order. Beyond a bent end
/// this would move the end towards the middle of its circle. There the arc continues as its mirror
/// image across the normal of its curve (arc_curve.h) at the end. Arcs of fewer than three points
/// stay, and arcs whose ring is shorter than VirtualPlaneConstants::ShortestRing. The ring of an
/// open arc leads along the arc and back. Parallel over arcs.
void SmoothInterfaces(const Scale& scale, const VirtualPlaneConstants& constants,
                      Interfaces& interfaces, SharedPoints& points);

}  // namespace partiemc
