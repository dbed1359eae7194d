#include "phases/phases.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/internal/research.h"
#include "frame/frame_view.h"
#include "phases/junction_angles.h"
#include "vertices/contacts.h"
#include "vertices/measure.h"
#include "vertices/placement.h"

namespace partiemc {
namespace {

// Interfaces move by at most this number of spacings to match areas.
constexpr double kAreaLimit = .5;
// The outline of a body moves by at most this number of spacings to keep its area at corners.
constexpr double kCornerLimit = .1;

// Copies the vertices of the body to the shared points.
void TakeBody(const PlacedVertices& placed, const Rings& body, double cell_size,
              SharedPoints& points) {
  const std::size_t count = body.PointCount();
  points.position.resize(count);
  points.anchor.resize(count);
  points.normal.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const Point at = PointAt(body.points, k), root = PointAt(placed.roots, k);
    points.position[k] = {at.x / cell_size, at.y / cell_size};
    points.anchor[k] = {root.x / cell_size, root.y / cell_size};
    points.normal[k] = {body.normals[2 * k], body.normals[2 * k + 1]};
  }
}

// Converts the shared points to world units. Vertices of the body that have not moved keep their
// bits.
void ToWorld(const PlacedVertices& placed, const Rings& body, double cell_size, Phases& p) {
  const auto convert = [&](const std::vector<Point>& from, std::span<const double> of_body,
                           std::vector<double>& to) {
    to.assign(of_body.begin(), of_body.end());
    to.resize(2 * from.size());
    for (std::size_t k = 0; k < from.size(); ++k) {
      const bool moves =
          k >= of_body.size() / 2 || (&from == &p.points.position && p.junctions.has_moved[k] != 0);
      if (!moves) continue;
      to[2 * k] = from[k].x * cell_size;
      to[2 * k + 1] = from[k].y * cell_size;
    }
    SnapToAxes(cell_size, to);
  };
  convert(p.points.position, body.points, p.world);
  convert(p.points.anchor, placed.roots, p.world_roots);
}

// Gives each ring the number of particles of its own phase; TraceRings has counted all particles.
void CountParticles(Phases& p) {
  for (std::size_t k = 0; k < p.rings.size(); ++k) {
    RingTopology& topology = p.rings[k].topology;
    for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
      const std::uint32_t region = p.images.RegionOf(k, topology.component_of_ring[ring]);
      const bool is_hole = topology.outer_of[ring] != kNoRing;
      topology.particle_count[ring] = is_hole ? 0 : p.areas.count[region];
    }
  }
}

// The direction to the right of the chord from the point before to the point after.
VertexNormal ChordNormal(std::span<const double> world, std::span<const std::uint32_t> ring,
                         std::size_t k) {
  const Point from = PointAt(world, ring[k == 0 ? ring.size() - 1 : k - 1]);
  const Point to = PointAt(world, ring[k + 1 == ring.size() ? 0 : k + 1]);
  const double x = to.y - from.y, y = from.x - to.x, length = std::sqrt(x * x + y * y);
  if (!(length > 0)) return {1, 0};
  return {static_cast<float>(x / length), static_cast<float>(y / length)};
}

void FindWetted(const Rings& body, Phases& p) {
  p.wet_next.clear();
  if (p.walls == nullptr) return;
  p.wet_next.assign(body.PointCount(), PhaseArc::kNoEnd);
  for (std::size_t ring = 0; ring < body.RingCount(); ++ring) {
    const std::uint32_t begin = body.offsets[ring], end = body.offsets[ring + 1];
    for (std::uint32_t k = begin; k < end; ++k) {
      if (p.walls->is_wet[k] != 0) p.wet_next[k] = k + 1 == end ? begin : k + 1;
    }
  }
}

// Whether a ring of a phase runs along a wall from point k to the next one.
bool IsWet(const Phases& p, std::span<const std::uint32_t> ring, std::size_t k) {
  const std::uint32_t next = ring[k + 1 == ring.size() ? 0 : k + 1];
  return ring[k] < p.wet_next.size() && p.wet_next[ring[k]] == next;
}

// Junctions and RingAreas may have moved free points of the body into walls.
void KeepBodyOffWalls(const PhaseInput& input, Phases& p) {
  for (std::size_t k = 0; p.walls != nullptr && k < p.junctions.has_moved.size(); ++k) {
    const std::uint32_t tile = p.walls->tile[k];
    if (p.junctions.has_moved[k] == 0 || IsOnWall(p.walls, k) || tile == kNoTile) continue;
    const std::vector<float>& sizes = input.vertices.sizes;
    const double size = sizes.empty() ? 1.0 : double{sizes[k]};
    Point& at = p.points.position[k];
    at = KeepOffWalls(input.walls, tile, input.scale.spacing * size, at);
  }
}

void FindPointsNearWalls(const PhaseInput& input, Phases& p) {
  p.near_walls = input.vertices.near_walls;
  if (p.walls == nullptr) return;
  const auto add = [&](const auto& place) {
    const float height = input.walls.HeightAt({place.tile, place.i, place.j});
    p.near_walls.push_back(height < WallField::kMostHeight ? 1 : 0);
  };
  for (const PhaseEdge& edge : p.map.edges) add(edge);
  for (const PhaseCell& cell : p.map.cells) add(cell);
}

// The angle of a phase at point k of its ring, if interfaces end there or the outline of the body
// meets a wall. `spacing`: world units.
std::optional<float> AngleOf(const Phases& p, std::span<const std::uint32_t> ring, std::size_t k,
                             double spacing) {
  const std::uint32_t point = ring[k];
  const bool is_body = p.numbers.IsBody(point);
  if (p.is_junction[point] != 0) {
    return JunctionAngle({ring, p.world, p.is_junction, p.walls}, k, !is_body, spacing);
  }
  const bool is_contact =
      is_body && p.walls != nullptr && p.walls->kind[point] == VertexKind::kContact;
  return is_contact ? std::optional(p.walls->angle[point]) : std::nullopt;
}

}  // namespace

std::uint64_t CountPhases(const ReconstructionParameters& parameters) {
  return static_cast<std::uint64_t>(std::ranges::count_if(
      parameters.sections, [](const Section& section) { return section.phase.has_value(); }));
}

absl::Status TakePhases(const Frame& frame, const ReconstructionParameters& parameters, Phases& p,
                        std::vector<Attribute>& others) {
  p.known.clear();
  for (const Section& section : parameters.sections) {
    if (section.phase) p.known.push_back(static_cast<float>(*section.phase));
  }
  std::span<const float> phases;
  absl::Status status = TakePhaseValues(frame, parameters.phase_attribute, phases, others);
  p.labels.clear();
  for (const float phase : phases) {
    const auto at = std::ranges::find(p.known, phase);
    p.labels.push_back(static_cast<PhaseLabel>(at - p.known.begin() + 1));
  }
  return status;
}

void LabelCopies(std::span<const std::uint32_t> originals, Phases& p) {
  for (const std::uint32_t original : originals) p.labels.push_back(p.labels[original]);
}

void MapPhases(const PhaseInput& input, Phases& p) {
  p.field.Build(input.bins, input.scale, p.labels);
  p.map.Build(input.bins.tiles, input.crossings, p.field);
}

bool PlacePhases(const PhaseInput& input, const PlacedVertices& placed, Phases& p, Rings& body) {
  const TileDirectory& directory = input.bins.tiles;
  const BodyOutline outline{input.crossings, input.topology, placed, input.vertices.vertices};
  p.vertices.Build(outline);
  p.numbers.edges = static_cast<std::uint32_t>(body.PointCount());
  p.numbers.cells = p.numbers.edges + static_cast<std::uint32_t>(p.map.edges.size());
  p.rings.resize(p.known.size() + 1);  // The last one: phases that no section has.
  for (std::size_t k = 0; k < p.rings.size(); ++k) {
    TracePhase(input.bins, input.scale, p.map, outline, p.vertices, p.numbers,
               static_cast<PhaseLabel>(k + 1), p.trace, p.rings[k]);
  }
  TakeBody(placed, body, input.scale.cell_size, p.points);
  p.junctions.has_moved.assign(body.PointCount(), 0);
  p.walls = input.vertices.WallPoints();
  FindWetted(body, p);
  FindInterfacePoints(directory, p.map, p.field, p.numbers, p.vertices, p.points);
  CollectArcs(directory, p.map, p.numbers, p.rings, p.interfaces);
  SmoothInterfaces(input.scale, input.variant.constants, p.interfaces, p.points);
  p.images.Build(input.percolation, outline, input.scale.cell_size, p.rings);
  p.ring_areas.Measure(body, p.images, p.points.position);
  const auto move_junctions = [&] {
    MoveJunctions(input.scale, body, p.walls, p.interfaces, p.images, p.junctions, p.points);
    p.ring_areas.Restore(body, p.walls, p.images, kCornerLimit * input.scale.spacing,
                         p.junctions.has_moved, p.points);
  };
  move_junctions();
  SumRegions({input.bins, input.scale, p.field, p.map, p.labels, input.originals, p.rings},
             p.images, p.areas);
  CountParticles(p);
  if (input.parameters.spacing.has_value() || !input.frame.volumes.empty()) {
    MatchPhaseAreas(p.rings, p.interfaces, p.images, kAreaLimit * input.scale.spacing, p.areas,
                    p.points);
    move_junctions();
  }
  KeepBodyOffWalls(input, p);
  p.is_junction.assign(p.points.position.size(), 0);
  for (const ArcEnd& end : p.junctions.ends) p.is_junction[end.junction] = 1;
  ToWorld(placed, body, input.scale.cell_size, p);
  FindPointsNearWalls(input, p);
  if (!RepairPhases(body, p.rings, p.world_roots, p.near_walls, p.repair, p.world)) return false;
  std::copy_n(p.world.begin(), body.points.size(), body.points.begin());
  for (std::size_t k = 0; k < body.PointCount(); ++k) {
    if (p.junctions.has_moved[k] == 0) continue;
    body.normals[2 * k] = p.points.normal[k].x;
    body.normals[2 * k + 1] = p.points.normal[k].y;
  }
  p.particle_counts.clear();
  for (const RingMeasures& of : body.measures) p.particle_counts.push_back(of.particle_count);
  MeasureRings(body);
  for (std::size_t k = 0; k < body.RingCount(); ++k) {
    body.measures[k].particle_count = p.particle_counts[k];
  }
  return true;
}

void WritePhaseRings(const Phases& p, const Scale& scale, PhaseLabel label, PlacedVertices& placed,
                     Rings& rings) {
  const PhaseRings& phase = p.rings[label - 1u];
  rings.Clear();
  rings.offsets = phase.offsets;
  rings.outer_of = phase.topology.outer_of;
  placed.roots.clear();
  for (std::size_t ring = 0; ring < phase.RingCount(); ++ring) {
    const std::span<const std::uint32_t> points = phase.RingPoints(ring);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const std::size_t point = points[k];
      rings.points.insert(rings.points.end(), &p.world[2 * point], &p.world[2 * point] + 2);
      placed.roots.insert(placed.roots.end(), &p.world_roots[2 * point],
                          &p.world_roots[2 * point] + 2);
      VertexNormal normal = ChordNormal(p.world, points, k);
      if (p.numbers.IsBody(points[k])) {
        normal = p.points.normal[point];
      } else if (p.numbers.IsEdge(points[k])) {
        const PhaseEdge& edge = p.map.edges[point - p.numbers.edges];
        const float sign = label == std::min(edge.from, edge.to) ? 1.0F : -1.0F;
        normal = {sign * p.points.normal[point].x, sign * p.points.normal[point].y};
      }
      rings.normals.insert(rings.normals.end(), {normal.x, normal.y});
      const auto number = phase.offsets[ring] + static_cast<std::uint32_t>(k);
      if (IsWet(p, points, k)) rings.wetted.push_back(number);
      const auto angle = AngleOf(p, points, k, scale.spacing * scale.cell_size);
      if (!angle) continue;
      rings.contacts.push_back(number);
      rings.contact_angles.push_back(*angle);
    }
  }
  MeasureRings(rings);
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    rings.measures[ring].particle_count = phase.topology.particle_count[ring];
  }
  placed.point_of_segment = phase.point_of_segment;
  placed.kept_as.resize(phase.RingCount());
  std::iota(placed.kept_as.begin(), placed.kept_as.end(), 0u);
  placed.group_of_ring.clear();
  placed.self_intersections = 0;
}

}  // namespace partiemc
