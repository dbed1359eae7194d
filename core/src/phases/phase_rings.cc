#include "phases/phase_rings.h"

#include "base/bits.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

// Traces one phase.
struct Tracing {
  const TileDirectory& directory;
  const PhaseMap& map;
  const BodyOutline& body;
  const BodyVertices& vertices;
  const PointNumbers& numbers;
  const PhaseLabel label;
  PhaseRings& rings;

  TilePlace PlaceOf(const ActiveCell& cell) const { return {cell.tile, cell.i, cell.j}; }

  // The label of the node across from the phase on an edge of a cell. Edge k joins corners k and k
  // + 1; a segment enters with the phase at corner k, and leaves with it at corner k + 1.
  PhaseLabel AcrossOf(const ActiveCell& cell, int edge, bool is_entry) const {
    const int corner = is_entry ? (edge + 1) & 3 : edge;
    return map.At(
        Normalise(directory, cell.tile, cell.i + kCornerX[corner], cell.j + kCornerY[corner]));
  }

  // The number of the shared point on an edge of a cell. Requires: two phases meet on the edge.
  std::uint32_t PointOn(const ActiveCell& cell, int edge) const {
    const TilePlace node =
        Normalise(directory, cell.tile, cell.i + (edge == 1), cell.j + (edge == 2));
    return numbers.edges + map.EdgeAt(node, (edge & 1) != 0);
  }

  void Add(std::uint32_t point, PhaseLabel across = kNoPhase) {
    rings.points.push_back(point);
    rings.across.push_back(across);
  }

  // Adds the points of a segment: first the one on its entry edge, then those in its cell.
  void AddSegment(std::uint32_t segment) {
    const Segment& here = rings.crossings.segments[segment];
    const ActiveCell& cell = rings.crossings.cells[here.cell];
    const TilePlace place = PlaceOf(cell);
    const PhaseLabel before = AcrossOf(cell, here.entry, true);
    const PhaseLabel after = AcrossOf(cell, here.exit, false);
    if (before != kNoPhase) {
      Add(PointOn(cell, here.entry), before);
    } else if (const std::uint32_t point =
                   vertices.EdgeVertex(vertices.Entering(place, here.entry));
               point != BodyVertices::kNone) {
      Add(point);
    }
    if (before == kNoPhase && after == kNoPhase) {
      const std::uint32_t entering = vertices.Entering(place, here.entry);
      Add(vertices.CellVertex(entering));
      // Two phases meet in the neck between two outlines of the body.
      if (vertices.ExitOf(entering) != here.exit) {
        Add(vertices.CellVertex(vertices.Leaving(place, here.exit)));
      }
    } else if (before == kNoPhase) {
      Add(vertices.CellVertex(vertices.Entering(place, here.entry)));
    } else if (after == kNoPhase) {
      Add(vertices.CellVertex(vertices.Leaving(place, here.exit)));
    } else if (const std::uint32_t own = map.CellAt(place); own != kNoIndex) {
      Add(numbers.cells + own);
    } else if (before != after) {
      Add(vertices.CellVertex(vertices.In(place)));
    }
  }
};

// Marks the nodes of a phase as inside, with a level set of 1 and -1.
void MarkInside(const PhaseMap& map, PhaseLabel label, LevelSet& level_set) {
  level_set.void_value = 1;
  level_set.tiles.resize(map.labels.size());
  level_set.inside.resize(map.labels.size());
  ParallelFor(map.labels.size(), [&](std::size_t tile) {
    BitRows& inside = level_set.inside[tile];
    for (int j = 0; j < kTileSize; ++j) {
      inside[j] = 0;
      for (int i = 0; i < kTileSize; ++i) {
        const int node = j * kTileSize + i;
        const bool is_inside = map.labels[tile][node] == label;
        inside[j] |= std::uint32_t{is_inside} << i;
        level_set.tiles[tile][node] = is_inside ? -1.0F : 1.0F;
      }
    }
  });
}

// Decides the saddles of a phase so that they agree with those of its neighbours.
void JoinSaddles(const TileDirectory& directory, const PhaseMap& map, const BodyOutline& body,
                 PhaseLabel label, Crossings& crossings) {
  for (std::uint32_t k = 0; k < crossings.cells.size(); ++k) {
    const ActiveCell& cell = crossings.cells[k];
    if (!cell.IsSaddle()) continue;
    const auto corners = map.CornersOf(directory, cell.tile, cell.i, cell.j);
    const std::uint64_t key = PhaseCell{cell.tile, cell.i, cell.j, 0}.Key();
    const bool is_active = (body.crossings.tiles[cell.tile].active[cell.j] >> cell.i & 1) != 0;
    const bool body_joined =
        is_active &&
        body.crossings.cells[CellAt(body.crossings, {cell.tile, cell.i, cell.j})].joined != 0;
    if (map.IsJoined(corners, label, key, body_joined)) JoinSaddle(crossings, k);
  }
}

}  // namespace

void BodyVertices::Build(const BodyOutline& body) {
  body_.emplace(body);
  place_.assign(body.crossings.segments.size(), kNone);
  for (std::uint32_t at = 0; at < body.topology.segments.size(); ++at) {
    place_[body.topology.segments[at]] = at;
  }
}

template <typename Matches>
std::uint32_t BodyVertices::Find(const TilePlace& cell, Matches matches) const {
  const ActiveCell& active = body_->crossings.cells[CellAt(body_->crossings, cell)];
  std::uint32_t segment = active.first_segment;
  if (active.IsSaddle() &&
      (place_[segment] == kNone || !matches(body_->crossings.segments[segment]))) {
    ++segment;
  }
  return place_[segment];
}

std::uint32_t BodyVertices::Entering(const TilePlace& cell, int edge) const {
  return Find(cell, [&](const Segment& segment) { return segment.entry == edge; });
}

std::uint32_t BodyVertices::Leaving(const TilePlace& cell, int edge) const {
  return Find(cell, [&](const Segment& segment) { return segment.exit == edge; });
}

std::uint32_t BodyVertices::In(const TilePlace& cell) const {
  return Find(cell, [](const Segment&) { return true; });
}

int BodyVertices::ExitOf(std::uint32_t at) const {
  return body_->crossings.segments[body_->topology.segments[at]].exit;
}

void TracePhase(const ParticleBins& bins, const Scale& scale, const PhaseMap& map,
                const BodyOutline& body, const BodyVertices& vertices, const PointNumbers& numbers,
                PhaseLabel label, PhaseTraceScratch& scratch, PhaseRings& rings) {
  MarkInside(map, label, scratch.level_set);
  FindCrossings(bins.tiles, scratch.level_set, rings.crossings);
  JoinSaddles(bins.tiles, map, body, label, rings.crossings);
  ReconstructionParameters traced;  // Small regions stay: only the body is cleaned.
  traced.clean = false;
  TraceRings(bins, scratch.level_set, scale, traced, rings.crossings, scratch.rings, rings.topology,
             true);
  rings.points.clear();
  rings.across.clear();
  rings.offsets.assign(1, 0);
  rings.point_of_segment.resize(rings.topology.segments.size());
  Tracing tracing{bins.tiles, map, body, vertices, numbers, label, rings};
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    for (std::uint32_t k = rings.topology.offsets[ring]; k < rings.topology.offsets[ring + 1];
         ++k) {
      tracing.AddSegment(rings.topology.segments[k]);
      rings.point_of_segment[k] = static_cast<std::uint32_t>(rings.points.size() - 1);
    }
    rings.offsets.push_back(static_cast<std::uint32_t>(rings.points.size()));
  }
}

}  // namespace partiemc
