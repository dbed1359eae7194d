#include "vertices/vertices.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>

#include "base/parallel.h"
#include "frame/placement_traits.h"
#include "normals/farthest_particle.h"
#include "vertices/contacts.h"
#include "vertices/intersections.h"
#include "vertices/measure.h"
#include "vertices/placement.h"
#include "vertices/thinning.h"
#include "vertices/virtual_plane.h"
#include "vertices/volume_correction.h"

namespace partiemc {
namespace {

void Store(Point point, double cell_size, double* target) {
  target[0] = point.x * cell_size;
  target[1] = point.y * cell_size;
}

// Writes the one or two vertices of segment k to `target`. Not for `virtual-plane`.
void PlaceSegment(const VertexInput& input, std::size_t k, double* target) {
  const CellPlane& plane = input.planes[k];
  const double cell_size = input.scale.cell_size;
  if (TraitsOf(input.parameters.placement).on_edges) {
    Store(plane.entry, cell_size, target);
    target += 2;
  }
  if (input.parameters.placement == Placement::kQef) {
    const Segment& segment = input.crossings.segments[input.topology.segments[k]];
    Store(ClampToCell(input.bins.tiles, plane.cell, segment, QefVertex(input, plane)), cell_size,
          target);
  } else if (TraitsOf(input.parameters.placement).takes_particles) {
    const Point vertex = FarthestParticle(input.bins.tiles, input.field)
                             .Vertex(plane, input.frame, input.parameters, input.scale);
    target[0] = vertex.x;
    target[1] = vertex.y;
  }
}

// Appends the unit vector along (x, y). If (x, y) is too short, appends the outward unit vector
// perpendicular to the segment, not the normal of the plane (normal_x, normal_y).
void AppendNormal(double x, double y, const CellPlane& plane, std::vector<float>& normals) {
  double square = x * x + y * y;
  if (square < kWeakGradientSquare) {
    x = plane.OutwardX();
    y = plane.OutwardY();
    square = x * x + y * y;
  }
  const double length = std::sqrt(square);
  normals.push_back(static_cast<float>(x / length));
  normals.push_back(static_cast<float>(y / length));
}

// The factor, +1 or -1, that turns the plane's normal outward. The memory of normals may have
// turned it inward.
double OutwardSign(const CellPlane& plane) {
  return plane.normal_x * plane.OutwardX() + plane.normal_y * plane.OutwardY() < 0 ? -1 : 1;
}

// Appends the normals of the vertices of segment `here`. An edge vertex gets the mean of the
// normals of the two cells that share the edge.
void AppendNormals(const VertexInput& input, std::size_t before, std::size_t here, Rings& rings) {
  const CellPlane& a = input.planes[before];
  const CellPlane& b = input.planes[here];
  const double sa = OutwardSign(a);
  const double sb = OutwardSign(b);
  const PlacementTraits& traits = TraitsOf(input.parameters.placement);
  if (traits.on_edges) {
    AppendNormal(sa * a.normal_x + sb * b.normal_x, sa * a.normal_y + sb * b.normal_y, b,
                 rings.normals);
  }
  if (traits.in_cells) {
    AppendNormal(sb * b.normal_x, sb * b.normal_y, b, rings.normals);
  }
}

bool AreEqual(const double* a, const double* b) { return a[0] == b[0] && a[1] == b[1]; }

// Appends the points of one ring without consecutive duplicates. Returns false, and appends
// nothing, if fewer than three points remain.
bool AppendRing(const VertexInput& input, std::size_t ring, int per_segment,
                std::span<const double> points, PlacedVertices& placed, Rings& rings) {
  const std::size_t first = input.topology.offsets[ring];
  const std::size_t last = input.topology.offsets[ring + 1];
  const std::size_t start = rings.PointCount();
  for (std::size_t k = first; k < last; ++k) {
    const double* source = points.data() + 2 * per_segment * k;
    const bool repeats = rings.PointCount() > start &&
                         AreEqual(source, rings.points.data() + rings.points.size() - 2);
    if (!repeats) {
      rings.points.insert(rings.points.end(), source, source + 2 * per_segment);
      AppendNormals(input, k == first ? last - 1 : k - 1, k, rings);
    }
    placed.point_of_segment[k] = static_cast<std::uint32_t>(rings.PointCount() - 1);
  }
  // The ring is closed, so its last points may repeat the first one.
  std::size_t end = rings.PointCount();
  while (end > start + 1 &&
         AreEqual(rings.points.data() + 2 * (end - 1), rings.points.data() + 2 * start)) {
    --end;
  }
  const bool keep = end - start >= 3;
  for (std::size_t k = first; k < last; ++k) {
    std::uint32_t& point = placed.point_of_segment[k];
    if (!keep) {
      point = kNoPoint;
    } else if (point >= end) {
      point = static_cast<std::uint32_t>(start);
    }
  }
  rings.points.resize(2 * (keep ? end : start));
  rings.normals.resize(2 * (keep ? end : start));
  return keep;
}

// Makes rings of the kept vertices of `virtual-plane`, matches the area and repairs the rings.
// Returns false if the repair failed.
bool JoinKeptVertices(const VertexInput& input, std::optional<double>& area_offset,
                      VertexScratch& scratch, PlacedVertices& placed, Rings& rings) {
  const RingVertices& vertices = scratch.vertices;
  const RingTopology& topology = input.topology;
  const double cell_size = input.scale.cell_size;
  std::uint32_t count = 0;
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    const auto of = [&](std::size_t segment) { return vertices.is_kept.begin() + 2 * segment; };
    count = std::accumulate(of(topology.offsets[ring]), of(topology.offsets[ring + 1]), count);
    rings.offsets.push_back(count);
  }
  rings.points.resize(2 * std::size_t{count});
  rings.normals.resize(2 * std::size_t{count});
  placed.roots.resize(2 * std::size_t{count});
  const bool has_walls = scratch.has_walls = input.walls != nullptr;
  const bool meets_walls = has_walls && std::ranges::any_of(vertices.meets_wall, std::identity());
  scratch.sizes.resize(input.scale.has_own_sizes ? count : 0);
  scratch.offset_factors.resize(meets_walls ? count : 0);
  scratch.near_walls.resize(has_walls ? count : 0);
  if (has_walls) scratch.walls.Resize(count);
  ParallelFor(topology.RingCount(), [&](std::size_t ring) {
    std::size_t point = rings.offsets[ring];
    for (std::size_t i = 2 * std::size_t{topology.offsets[ring]};
         i < 2 * std::size_t{topology.offsets[ring + 1]}; ++i) {
      placed.point_of_segment[i / 2] = kNoPoint;
      if (!vertices.is_kept[i]) continue;
      // The cell vertex comes after the edge vertex, so its index remains.
      placed.point_of_segment[i / 2] = static_cast<std::uint32_t>(point);
      Store(vertices.point[i], cell_size, &rings.points[2 * point]);
      Store(vertices.root[i], cell_size, &placed.roots[2 * point]);
      rings.normals[2 * point] = vertices.normal[i].x;
      rings.normals[2 * point + 1] = vertices.normal[i].y;
      if (!vertices.size.empty()) scratch.sizes[point] = vertices.size[i];
      if (has_walls) {
        scratch.walls.Copy(vertices.walls, i, point);
        scratch.near_walls[point] = vertices.walls.tile[i] != kNoTile ? 1 : 0;
      }
      if (meets_walls) {
        const bool is_free = vertices.walls.kind[i] == VertexKind::kFree;
        scratch.offset_factors[point] = is_free ? static_cast<float>(vertices.SizeOf(i)) : 0;
      }
      ++point;
    }
  });
  rings.outer_of = topology.outer_of;
  std::iota(placed.kept_as.begin(), placed.kept_as.end(), 0u);
  if (meets_walls) FitContacts(input, scratch.sizes, scratch.walls, rings);
  CorrectVolume(input, {scratch.sizes, meets_walls ? scratch.offset_factors : scratch.sizes},
                scratch.offset_points, area_offset, rings);
  if (meets_walls) FitContacts(input, scratch.sizes, scratch.walls, rings);
  if (has_walls) PinToWalls(input, scratch.sizes, scratch.walls, rings);
  if (meets_walls) ListContacts(scratch.walls, rings);
  SnapToAxes(cell_size, rings.points);
  SnapToAxes(cell_size, placed.roots);
  return RepairRings(placed.roots, scratch.near_walls, scratch.repair, rings);
}

// Places the rings of `virtual-plane`. Rings are certainly simple only with a vertex in each cell:
// if the repair fails without some, they return. Returns false if it fails with all of them.
bool PlaceRefinedRings(const VertexInput& input, std::optional<double>& area_offset,
                       VertexScratch& scratch, PlacedVertices& placed, Rings& rings) {
  PlaceOnVirtualPlanes(input, scratch.vertices);
  const std::optional<double> last_offset = area_offset;
  if (JoinKeptVertices(input, area_offset, scratch, placed, rings)) return true;
  if (!KeepCellVertices(scratch.vertices)) return false;
  area_offset = last_offset;
  rings.Clear();
  return JoinKeptVertices(input, area_offset, scratch, placed, rings);
}

// Places the rings of all placements except `virtual-plane`, segment by segment.
void PlaceRings(const VertexInput& input, VertexScratch& scratch, PlacedVertices& placed,
                Rings& rings) {
  const RingTopology& topology = input.topology;
  const PlacementTraits& traits = TraitsOf(input.parameters.placement);
  const int per_segment = traits.on_edges + traits.in_cells;
  placed.roots.clear();
  scratch.points.resize(2 * per_segment * topology.segments.size());
  ParallelFor(topology.segments.size(), [&](std::size_t k) {
    PlaceSegment(input, k, scratch.points.data() + 2 * per_segment * k);
  });
  SnapToAxes(input.scale.cell_size, scratch.points);
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    placed.kept_as[ring] = kNoRing;
    if (!AppendRing(input, ring, per_segment, scratch.points, placed, rings)) continue;
    placed.kept_as[ring] = static_cast<std::uint32_t>(rings.RingCount());
    rings.offsets.push_back(static_cast<std::uint32_t>(rings.PointCount()));
    rings.outer_of.push_back(topology.outer_of[ring]);
  }
  // A hole whose outer ring was dropped becomes an outer ring.
  for (std::uint32_t& outer : rings.outer_of) {
    if (outer != kNoRing) outer = placed.kept_as[outer];
  }
  MeasureRings(rings);
  // The rings of the other placements are simple, so only Validate counts their touching pairs.
  if (!traits.takes_particles) return;
  placed.self_intersections = CountTouchingPairs(rings.points, rings.offsets, scratch.repair.pairs);
}

}  // namespace

bool PlaceVertices(const VertexInput& input, std::optional<double>& area_offset,
                   VertexScratch& scratch, PlacedVertices& placed, Rings& rings) {
  const RingTopology& topology = input.topology;
  rings.Clear();
  placed.self_intersections = 0;
  scratch.has_walls = false;
  placed.group_of_ring.clear();
  placed.point_of_segment.resize(topology.segments.size());
  placed.kept_as.resize(topology.RingCount());
  if (TraitsOf(input.parameters.placement).refines) {
    if (!PlaceRefinedRings(input, area_offset, scratch, placed, rings)) return false;
  } else {
    PlaceRings(input, scratch, placed, rings);
  }
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    const std::uint32_t kept_as = placed.kept_as[ring];
    if (kept_as != kNoRing) rings.measures[kept_as].particle_count = topology.particle_count[ring];
  }
  return true;
}

}  // namespace partiemc
