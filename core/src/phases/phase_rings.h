// The outlines of the phases of a body, as sequences of points that neighbouring phases share.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "crossings/crossings.h"
#include "field/field.h"
#include "phases/phase_map.h"
#include "rings/rings.h"
#include "vertices/vertices.h"

namespace partiemc {

/// The outline of all particles, with vertices.
struct BodyOutline {
  const Crossings& crossings;
  const RingTopology& topology;
  const PlacedVertices& placed;
  const RingVertices& vertices;
};

/// Finds vertices of the outline of a body by their cell, and by the edge of the cell through which
/// the outline enters or leaves.
class BodyVertices {
 public:
  /// Cost: linear in segments.
  void Build(const BodyOutline& body);

  static constexpr std::uint32_t kNone = 0xffffffff;

  /// The place in RingTopology::segments of the segment that enters, or leaves, a cell through its
  /// edge 0 to 3 (crossings.h). Requires: there is one.
  std::uint32_t Entering(const TilePlace& cell, int edge) const;
  std::uint32_t Leaving(const TilePlace& cell, int edge) const;
  /// The edge through which a segment leaves its cell.
  int ExitOf(std::uint32_t at) const;
  /// The segment of a cell that has only one in the topology.
  std::uint32_t In(const TilePlace& cell) const;

  /// Index in Rings::points of a segment's vertex in its cell; and of the vertex on the edge where
  /// the segment enters the cell, or kNone if thinning has dropped the vertex on the edge.
  std::uint32_t CellVertex(std::uint32_t at) const { return body_->placed.point_of_segment[at]; }
  std::uint32_t EdgeVertex(std::uint32_t at) const {
    return body_->vertices.is_kept[2 * std::size_t{at}] ? CellVertex(at) - 1 : kNone;
  }

 private:
  template <typename Matches>
  std::uint32_t Find(const TilePlace& cell, Matches matches) const;

  std::optional<BodyOutline> body_;
  std::vector<std::uint32_t> place_;  // By segment: its place in the topology, or kNone.
};

/// Numbers of shared points: first the points of the body's rings, then the edges of the map, then
/// its cells.
struct PointNumbers {
  std::uint32_t edges = 0;  ///< The number of the first edge.
  std::uint32_t cells = 0;  ///< The number of the first cell.

  bool IsBody(std::uint32_t point) const { return point < edges; }
  bool IsEdge(std::uint32_t point) const { return point >= edges && point < cells; }
};

/// The outline of one phase.
struct PhaseRings {
  Crossings crossings;
  RingTopology topology;
  std::vector<std::uint32_t> points;  ///< Numbers of shared points, ring by ring.
  /// By point: on a lattice edge, the phase of its other node; kNoPhase for other points.
  std::vector<PhaseLabel> across;
  std::vector<std::uint32_t> offsets;  ///< Ring k has points [offsets[k], offsets[k + 1]).
  /// By element of RingTopology::segments: index in `points` of its last point.
  std::vector<std::uint32_t> point_of_segment;

  std::size_t RingCount() const { return topology.RingCount(); }
  std::span<const std::uint32_t> RingPoints(std::size_t ring) const {
    return std::span(points).subspan(offsets[ring], offsets[ring + 1] - offsets[ring]);
  }
};

/// Scratch of TracePhase.
struct PhaseTraceScratch {
  LevelSet level_set;
  RingScratch rings;
};

/// Traces the outline of one phase. Deterministic. Cost: linear in tiles, nodes near phases,
/// segments and particles.
void TracePhase(const ParticleBins& bins, const Scale& scale, const PhaseMap& map,
                const BodyOutline& body, const BodyVertices& vertices, const PointNumbers& numbers,
                PhaseLabel label, PhaseTraceScratch& scratch, PhaseRings& rings);

}  // namespace partiemc
