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

/// A piece of an interface, with one phase on its left and another, of a larger label, on its
/// right.
struct PhaseArc {
  static constexpr std::uint32_t kNoEnd = 0xffffffff;

  std::uint32_t first = 0, last = 0;  ///< Its inner points are Interfaces::points[first, last).
  std::uint32_t start = kNoEnd, end = kNoEnd;  ///< Junctions; kNoEnd for a closed arc.
  PhaseLabel left = 0, right = 0;
  std::uint32_t left_component = 0, right_component = 0;  ///< Of their phases' topologies.

  bool IsClosed() const { return start == kNoEnd; }
};

/// Positions of shared points (PointNumbers), in cells from the origin of the world.
struct SharedPoints {
  std::vector<Point> position;
  std::vector<Point> anchor;  ///< With all points at their anchors, the outlines are valid.
  /// Unit; of the body's points outward, of the interface from the lower to the higher label. Not
  /// known for cells.
  std::vector<VertexNormal> normal;
};

struct Interfaces {
  std::vector<PhaseArc> arcs;
  std::vector<std::uint32_t> points;  ///< Numbers of shared points.
  PeriodicRings rings;                ///< Scratch of SmoothInterfaces.
  std::vector<Point> ring;            ///< Scratch of the same.

  std::span<const std::uint32_t> InnerPoints(const PhaseArc& arc) const {
    return std::span(points).subspan(arc.first, arc.last - arc.first);
  }
};

/// Sets the points of edges and cells: on the boundary of the phases on each edge, and in the
/// middle of each cell. Parallel over edges. Cost: six kernel sums for each edge.
void FindInterfacePoints(const TileDirectory& directory, const PhaseMap& map,
                         const PhaseField& field, const PointNumbers& numbers,
                         const BodyVertices& vertices, SharedPoints& points);

/// Collects the arcs. `phases`: by label less one. Cost: linear in points.
void CollectArcs(const TileDirectory& directory, const PhaseMap& map, const PointNumbers& numbers,
                 std::span<const PhaseRings> phases, Interfaces& interfaces);

/// Smooths the arcs as steps 2 and 3 of the default placement smooth rings (core/METHOD.md),
/// without supports. An open arc is smoothed as the ring that runs along it and back. A bent end
/// continues as its mirror image across a normal of its curve (arc_curve.h) instead, as a circle
/// does; otherwise the smoothing would move bent ends towards the middle of their circles. Arcs
/// whose ring is shorter than VirtualPlaneConstants::ShortestRing stay. Parallel over arcs.
void SmoothInterfaces(const Scale& scale, const VirtualPlaneConstants& constants,
                      Interfaces& interfaces, SharedPoints& points);

}  // namespace partiemc
