#include "rings/rings.h"

#include <algorithm>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "hwy/cache_control.h"
#include "partiemc/result.h"

namespace partiemc {
namespace {

// Cleaning closes holes below this area, in squared spacings: they are dents of the level set, not
// voids of the fluid (core/METHOD.md, "Cleaning").
constexpr double kMinHoleParticles = 2;
static_assert(kMinHoleParticles <= kHoleMarginParticles, "tiles must reach into such a hole");

// The same around grains: the void between six equal grains is smaller, between seven it is larger
// (core/SIZES.md, "Grains").
constexpr double kMinGrainHole = 0.5;

// Minimum number of segments per task.
constexpr std::size_t kSegmentGrain = 512;

// Minimum number of rings per task.
constexpr std::size_t kRingGrain = 64;

// Prefetch distance in segments.
constexpr std::size_t kFetchedAhead = 16;

// Joins segments to rings. Successors are found in parallel; only the walk along rings is
// sequential.
void Trace(const TileDirectory& directory, const Crossings& crossings,
           std::vector<std::uint32_t>& next, RingTopology& rings) {
  constexpr std::uint32_t kTaken = 0xffffffff;
  const std::size_t count = crossings.segments.size();
  next.resize(count);
  ParallelForRanges(count, kSegmentGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t segment = first; segment < last; ++segment) {
      next[segment] = NextSegment(directory, crossings, static_cast<std::uint32_t>(segment));
    }
  });
  rings.segments.resize(count);
  rings.offsets.assign(1, 0);
  std::uint32_t taken = 0;
  for (std::uint32_t first = 0; first < count; ++first) {
    for (std::uint32_t segment = first; next[segment] != kTaken;
         segment = std::exchange(next[segment], kTaken)) {
      rings.segments[taken++] = segment;
    }
    if (taken > rings.offsets.back()) rings.offsets.push_back(taken);
  }
}

// The nodes of the lattice edge through which a segment enters its cell.
struct EdgeNodes {
  TilePlace inside, outside;
};

EdgeNodes EntryNodes(const TileDirectory& directory, const Crossings& crossings,
                     std::uint32_t segment) {
  const Segment& here = crossings.segments[segment];
  const ActiveCell& cell = crossings.cells[here.cell];
  const auto node = [&](int corner) {
    return Normalise(directory, cell.tile, cell.i + kCornerX[corner], cell.j + kCornerY[corner]);
  };
  // Edge k joins corners k and k + 1. The inside is on the left of the segment, so the first corner
  // of its entry edge is the inside node.
  return {node(here.entry), node((here.entry + 1) & 3)};
}

// Prefetches the level set at the corners of a cell, except corners in the next tile.
void FetchCorners(const LevelSet& level_set, const ActiveCell& cell) {
  const float* lower = level_set.tiles[cell.tile].data() + cell.j * kTileSize + cell.i;
  hwy::Prefetch(lower);
  if (cell.j + 1 < kTileSize) hwy::Prefetch(lower + kTileSize);
}

// Sets the points where segments enter their cells.
void FindEntryPoints(const TileDirectory& directory, const LevelSet& level_set,
                     const Crossings& crossings, RingTopology& rings) {
  const std::size_t count = rings.segments.size();
  rings.entry_points.resize(count);
  ParallelForRanges(count, kSegmentGrain, [&](std::size_t first, std::size_t last) {
    const auto segment_of = [&](std::size_t k) -> const Segment& {
      return crossings.segments[rings.segments[k]];
    };
    const auto cell_of = [&](std::size_t k) -> const ActiveCell& {
      return crossings.cells[segment_of(k).cell];
    };
    for (std::size_t k = first; k < last; ++k) {
      // The address of the values depends on the cell, and the address of the cell on the segment.
      // Each is prefetched one step before the next.
      if (k + 3 * kFetchedAhead < last) hwy::Prefetch(&segment_of(k + 3 * kFetchedAhead));
      if (k + 2 * kFetchedAhead < last) hwy::Prefetch(&cell_of(k + 2 * kFetchedAhead));
      if (k + kFetchedAhead < last) FetchCorners(level_set, cell_of(k + kFetchedAhead));
      rings.entry_points[k] = EdgeCrossing(directory, level_set, cell_of(k), segment_of(k).entry);
    }
  });
}

void MeasureAreas(const RingTopology& rings, RingScratch& scratch) {
  scratch.area.resize(rings.offsets.size() - 1);
  ParallelForRanges(scratch.area.size(), kRingGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t ring = first; ring < last; ++ring)
      scratch.area[ring] = AreaOfRing(rings, ring);
  });
}

// Clears the nodes of the marked components.
void ClearDropped(const RingTopology& rings, const RingScratch& scratch, Crossings& crossings) {
  rings.components.ForEachRun(
      crossings, [&](std::uint32_t tile, int j, std::uint32_t mask, std::uint32_t component) {
        // ForEachRun has read this row already, so the row may change.
        if (scratch.dropped[component]) crossings.tiles[tile].inside[j] &= ~mask;
      });
}

// Clears the nodes of components without particles.
void DropEmptyComponents(RingScratch& scratch, Crossings& crossings, RingTopology& rings) {
  scratch.dropped.clear();
  for (const std::uint64_t count : scratch.particle_count) scratch.dropped.push_back(count == 0);
  rings.dropped_components = static_cast<std::uint64_t>(
      std::count(scratch.dropped.begin(), scratch.dropped.end(), std::uint8_t{1}));
  if (rings.dropped_components > 0) ClearDropped(rings, scratch, crossings);
}

// Makes all nodes inside that a ring encloses. The ring crosses a row of the lattice in pairs of
// horizontal edges, and the enclosed nodes lie between the edges of a pair.
void FillRing(const TileDirectory& directory, const RingTopology& rings, std::size_t ring,
              Crossings& crossings, std::vector<std::pair<std::int64_t, std::int64_t>>& edges) {
  edges.clear();
  for (std::uint32_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
    const Segment& segment = crossings.segments[rings.segments[k]];
    if (segment.entry & 1) continue;  // A vertical edge.
    const ActiveCell& cell = crossings.cells[segment.cell];
    const TileCoordinate& tile = directory[cell.tile];
    edges.emplace_back((std::int64_t{tile.y} << kTileShift) + cell.j + (segment.entry == 2),
                       (std::int64_t{tile.x} << kTileShift) + cell.i);
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t k = 0; k + 1 < edges.size(); k += 2) {
    const auto row = edges[k].first;
    for (std::int64_t column = edges[k].second + 1; column <= edges[k + 1].second; ++column) {
      const std::uint32_t tile = directory.Find({static_cast<std::int32_t>(row >> kTileShift),
                                                 static_cast<std::int32_t>(column >> kTileShift)});
      crossings.tiles[tile].inside[row & (kTileSize - 1)] |= std::uint32_t{1}
                                                             << (column & (kTileSize - 1));
    }
  }
}

// Removes the rings whose nodes have been cleared or filled: both sides are inside, or both are
// outside.
void KeepSurvivors(const TileDirectory& directory, const Crossings& crossings, RingScratch& scratch,
                   RingTopology& rings) {
  std::size_t kept = 0;
  std::uint32_t end = 0;
  for (std::size_t ring = 0; ring + 1 < rings.offsets.size(); ++ring) {
    const std::uint32_t first = rings.offsets[ring];
    const std::uint32_t last = rings.offsets[ring + 1];
    const EdgeNodes nodes = EntryNodes(directory, crossings, rings.segments[first]);
    if (IsInside(crossings, nodes.inside) == IsInside(crossings, nodes.outside)) continue;
    std::copy(rings.segments.begin() + first, rings.segments.begin() + last,
              rings.segments.begin() + end);
    std::copy(rings.entry_points.begin() + first, rings.entry_points.begin() + last,
              rings.entry_points.begin() + end);
    scratch.area[kept] = scratch.area[ring];
    rings.offsets[kept++] = end;
    end += last - first;
  }
  rings.segments.resize(end);
  rings.entry_points.resize(end);
  scratch.area.resize(kept);
  rings.offsets.resize(kept + 1);
  rings.offsets[kept] = end;
}

void CountComponents(const ParticleBins& bins, const Crossings& crossings, RingScratch& scratch,
                     RingTopology& rings) {
  rings.components.Label(bins.tiles, crossings);
  scratch.particle_count.assign(rings.components.size(), 0);
  scratch.particle_weight.assign(rings.components.size(), 0);
  rings.components.CountParticles(bins, crossings, scratch.particle_count, scratch.particle_weight);
}

void Clean(const ParticleBins& bins, const Scale& scale, Crossings& crossings, RingScratch& scratch,
           RingTopology& rings) {
  DropEmptyComponents(scratch, crossings, rings);
  if (rings.dropped_components > 0) KeepSurvivors(bins.tiles, crossings, scratch, rings);
  const double particles = scale.has_grains ? kMinGrainHole : kMinHoleParticles;
  const double min_area = particles * scale.spacing * scale.spacing;
  for (std::size_t ring = 0; ring + 1 < rings.offsets.size(); ++ring) {
    const double area = scratch.area[ring];
    if (area < 0 && -area < min_area) {
      FillRing(bins.tiles, rings, ring, crossings, scratch.edges);
      ++rings.dropped_holes;
    }
  }
  if (rings.dropped_holes > 0) KeepSurvivors(bins.tiles, crossings, scratch, rings);
  if (rings.dropped_holes + rings.dropped_components > 0) {
    MarkInteriorCells(bins.tiles, crossings);
    CountComponents(bins, crossings, scratch, rings);
  }
}

// Assigns holes to outer rings and particles to components. The rings of a component are one outer
// ring and its holes.
void Nest(const ParticleBins& bins, const Crossings& crossings, RingScratch& scratch,
          RingTopology& rings) {
  const std::size_t ring_count = rings.offsets.size() - 1;
  rings.outer_ring.assign(rings.components.size(), kNoRing);
  rings.component_of_ring.resize(ring_count);
  for (std::size_t ring = 0; ring < ring_count; ++ring) {
    const EdgeNodes nodes = EntryNodes(bins.tiles, crossings, rings.segments[rings.offsets[ring]]);
    const std::uint32_t component = rings.components.At(crossings, nodes.inside);
    rings.component_of_ring[ring] = component;
    if (scratch.area[ring] >= 0) rings.outer_ring[component] = static_cast<std::uint32_t>(ring);
  }
  rings.outer_of.assign(ring_count, kNoRing);
  rings.particle_count.assign(ring_count, 0);
  rings.particle_weight.assign(ring_count, 0);
  for (std::size_t ring = 0; ring < ring_count; ++ring) {
    const std::uint32_t component = rings.component_of_ring[ring];
    if (scratch.area[ring] < 0) {
      rings.outer_of[ring] = rings.outer_ring[component];
    } else {
      rings.particle_count[ring] = scratch.particle_count[component];
      rings.particle_weight[ring] = scratch.particle_weight[component];
    }
  }
}

// Finds the outer ring around each outer ring. Edges are visited by row, so the first visited edge
// of an outer ring is in its lowest row. The edge on the left of it belongs to a hole, whose outer
// ring contains both, or to an outer ring in the same void, which was visited before.
void FindContainers(const TileDirectory& directory, const Crossings& crossings,
                    const RingTopology& rings, RingScratch& scratch) {
  scratch.outer_rings.clear();
  scratch.container.assign(rings.RingCount(), kNoRing);
  scratch.visited.assign(rings.RingCount(), 0);
  scratch.rows.SetRings(crossings, rings.segments, rings.offsets);
  CrossedEdge last;
  scratch.rows.ForEachEdge(directory, crossings, [&](const CrossedEdge& edge) {
    const CrossedEdge left = last;
    last = edge;
    if (rings.outer_of[edge.ring] != kNoRing || scratch.visited[edge.ring]) return;
    scratch.visited[edge.ring] = 1;
    scratch.outer_rings.push_back(edge.ring);
    if (left.ring == kNoRing || left.row != edge.row) return;
    const std::uint32_t around = rings.outer_of[left.ring];
    scratch.container[edge.ring] = around != kNoRing ? around : scratch.container[left.ring];
  });
}

// Marks the components that are spray or lie inside spray. Returns their number.
std::uint64_t FindSpray(const ReconstructionParameters& parameters, double spacing,
                        const RingTopology& rings, RingScratch& scratch) {
  // `outer_rings` has each ring after the ring around it. In reverse order, the sum of each ring is
  // therefore complete when it is added to the ring around.
  scratch.enclosed = rings.particle_count;
  for (std::size_t k = scratch.outer_rings.size(); k-- > 0;) {
    const std::uint32_t ring = scratch.outer_rings[k];
    const std::uint32_t around = scratch.container[ring];
    if (around != kNoRing) scratch.enclosed[around] += scratch.enclosed[ring];
  }
  const double min_area = parameters.min_component_area * spacing * spacing;
  scratch.dropped.assign(rings.components.size(), 0);
  std::uint64_t count = 0;
  for (const std::uint32_t ring : scratch.outer_rings) {
    const std::uint32_t around = scratch.container[ring];
    const bool drop = scratch.area[ring] < min_area ||
                      scratch.enclosed[ring] < parameters.min_component_particles ||
                      (around != kNoRing && scratch.dropped[rings.component_of_ring[around]]);
    if (!drop) continue;
    scratch.dropped[rings.component_of_ring[ring]] = 1;
    ++count;
  }
  return count;
}

void DropSpray(const ParticleBins& bins, const Scale& scale,
               const ReconstructionParameters& parameters, Crossings& crossings,
               RingScratch& scratch, RingTopology& rings) {
  FindContainers(bins.tiles, crossings, rings, scratch);
  rings.dropped_spray = FindSpray(parameters, scale.spacing, rings, scratch);
  if (rings.dropped_spray == 0) return;
  ClearDropped(rings, scratch, crossings);
  KeepSurvivors(bins.tiles, crossings, scratch, rings);
  MarkInteriorCells(bins.tiles, crossings);
  CountComponents(bins, crossings, scratch, rings);
  Nest(bins, crossings, scratch, rings);
}

}  // namespace

double AreaOfRing(const RingTopology& rings, std::size_t ring) {
  const std::span<const Point> points =
      std::span(rings.entry_points)
          .subspan(rings.offsets[ring], rings.offsets[ring + 1] - rings.offsets[ring]);
  double twice_area = 0;
  const Point origin = points[0];
  for (std::size_t k = 1; k + 1 < points.size(); ++k) {
    twice_area += (points[k].x - origin.x) * (points[k + 1].y - origin.y) -
                  (points[k + 1].x - origin.x) * (points[k].y - origin.y);
  }
  return twice_area / 2;
}

void TraceRings(const ParticleBins& bins, const LevelSet& level_set, const Scale& scale,
                const ReconstructionParameters& parameters, Crossings& crossings,
                RingScratch& scratch, RingTopology& rings, bool keeps_spray) {
  rings.dropped_holes = 0;
  rings.dropped_components = 0;
  rings.dropped_spray = 0;
  ParallelInvoke(
      [&] {
        Trace(bins.tiles, crossings, scratch.next_segment, rings);
        FindEntryPoints(bins.tiles, level_set, crossings, rings);
        MeasureAreas(rings, scratch);
      },
      [&] { CountComponents(bins, crossings, scratch, rings); });
  if (*parameters.clean) Clean(bins, scale, crossings, scratch, rings);
  Nest(bins, crossings, scratch, rings);
  const bool has_limit =
      parameters.min_component_area > 0 || parameters.min_component_particles > 0;
  if (has_limit && !keeps_spray) {
    DropSpray(bins, scale, parameters, crossings, scratch, rings);
  }
}

}  // namespace partiemc
