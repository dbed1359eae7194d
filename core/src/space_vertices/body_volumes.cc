#include "space_vertices/body_volumes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "base/parallel.h"

namespace partiemc::space {
namespace {

/// Calls visit(from, to) for each curve of a loop, from one crossing to the next.
template <typename Visit>
void ForEachCurve(const SpaceCrossings& crossings, const ActiveCell& cell, int loop, Visit visit) {
  const CellLoops& loops = LoopsOf(cell.corners);
  const std::uint32_t* const edges = crossings.StepEdgesOf(cell);
  for (int step = loops.first[loop]; step < loops.first[loop + 1]; ++step) {
    visit(edges[step], edges[loops.Next(step)]);
  }
}

/// The origin of the sums of a body, in cells. It is near the body, so that sums lose no digits.
Vec3 LowestNodeOf(const BrickDirectory& bricks, const Body& body) {
  const BrickPlace& at = body.lowest;
  return OriginOf(bricks[at.brick]) + Vec3{1.0 * at.i, 1.0 * at.j, 1.0 * at.k};
}

/// The box in other units, relative to an origin in these units.
ClipBox Relative(const ClipBox& box, double units, const Vec3& origin) {
  return {units * box.low - origin, units * box.high - origin};
}

/// The box to which the measures of a body are restricted; absent for its whole volume.
const std::optional<ClipBox>& ClipOf(const BodyVolumes& volumes, const Bodies& bodies,
                                     std::uint32_t body) {
  return volumes.in_box && bodies.IsCut(body) ? volumes.in_box : volumes.before_walls;
}

/// Gives all images of a body that is cut the sum of their measures, and gone images the measures
/// of the image that remains, so that they move alike.
void ShareMeasures(const Bodies& bodies, BodyVolumes& volumes) {
  if (!volumes.in_box) return;
  for (std::uint32_t body = 0; body < bodies.bodies.size(); ++body) {
    const std::uint32_t first = bodies.bodies[body].first_image;
    if (first == body || bodies.IsGone(body)) continue;
    volumes.measures[first].area += volumes.measures[body].area;
    volumes.measures[first].volume += volumes.measures[body].volume;
  }
  for (std::uint32_t body = 0; body < bodies.bodies.size(); ++body) {
    volumes.measures[body] = volumes.measures[bodies.bodies[body].first_image];
  }
}

/// Calls visit(cell, loop of the cell, loop) for all loops, in parallel over cells.
template <typename Visit>
void ForEachLoopOfCells(const SpaceCrossings& crossings, const Visit& visit) {
  ParallelFor(static_cast<std::uint32_t>(crossings.cells.size()), [&](std::uint32_t index) {
    const ActiveCell& cell = crossings.cells[index];
    for (int loop = 0; loop < LoopsOf(cell.corners).loops; ++loop) {
      visit(cell, loop, cell.first_loop - crossings.edge_count + loop);
    }
  });
}

}  // namespace

void FindBodyOfVertices(const BrickDirectory& bricks, const SpaceField& field,
                        const SpaceCrossings& crossings, const Bodies& bodies,
                        BodyVolumes& volumes) {
  volumes.body_of.resize(crossings.VertexCount());
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      BrickPlace node{brick, i, j, k};
      if (!field.IsInside(node)) {
        node = Normalise(bricks, brick, i + (axis == 0), j + (axis == 1), k + (axis == 2));
      }
      volumes.body_of[v] = bodies.BodyOf(node);
    });
  });
  ForEachLoopOfCells(crossings, [&](const ActiveCell& cell, int loop, std::uint32_t index) {
    const int first = LoopsOf(cell.corners).first[loop];
    volumes.body_of[crossings.edge_count + index] =
        volumes.body_of[crossings.StepEdgesOf(cell)[first]];
  });
}

void MeasureBodies(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                   const Bodies& bodies, const std::vector<Vec3>& positions, BodyVolumes& volumes) {
  const auto origin_of = [&](std::uint32_t body) {
    return LowestNodeOf(bricks, bodies.bodies[body]);
  };
  volumes.areas.resize(crossings.loop_count);
  volumes.parts.resize(crossings.loop_count);
  ForEachLoopOfCells(crossings, [&](const ActiveCell& cell, int loop, std::uint32_t index) {
    const std::uint32_t vertex = crossings.edge_count + index;
    const std::uint32_t body = volumes.body_of[vertex];
    const std::optional<ClipBox>& clip = ClipOf(volumes, bodies, body);
    const Vec3 origin = origin_of(body);
    const Vec3 a = positions[vertex] - origin;
    double area = 0;
    BodyVolumes::Part part;
    ForEachCurve(crossings, cell, loop, [&](std::uint32_t from, std::uint32_t to) {
      const Vec3 b = positions[from] - origin, c = positions[to] - origin;
      area += Length(Cross(b - a, c - a)) / 2;
      if (clip) {
        const ClippedMeasure clipped =
            MeasureClipped(a, b, c, Relative(*clip, 1 / cell_size, origin));
        part.area += clipped.area;
        part.volume += clipped.volume;
      } else {
        part.volume += Dot(a, Cross(b, c)) / 6;
      }
    });
    volumes.areas[index] = area;
    if (!clip) part.area = area;
    volumes.parts[index] = part;
  });
  volumes.measures.assign(bodies.bodies.size(), {});
  for (std::uint32_t loop = 0; loop < crossings.loop_count; ++loop) {
    const std::uint32_t vertex = crossings.edge_count + loop;
    BodyMeasure& measure = volumes.measures[volumes.body_of[vertex]];
    measure.area += volumes.parts[loop].area * volumes.SizeOf(vertex);
    measure.volume += volumes.parts[loop].volume;
  }
  ShareMeasures(bodies, volumes);
}

void MeasureTriangles(const BrickDirectory& bricks, double cell_size, const Bodies& bodies,
                      std::span<const Vec3> positions, std::span<const VertexTriangle> triangles,
                      BodyVolumes& volumes) {
  volumes.measures.assign(bodies.bodies.size(), {});
  for (const VertexTriangle& triangle : triangles) {
    const std::uint32_t body = volumes.body_of[triangle[0]];
    const Vec3 origin = cell_size * LowestNodeOf(bricks, bodies.bodies[body]);
    const Vec3 a = positions[triangle[0]] - origin, b = positions[triangle[1]] - origin,
               c = positions[triangle[2]] - origin;
    const std::optional<ClipBox>& clip = ClipOf(volumes, bodies, body);
    const ClippedMeasure part =
        clip ? MeasureClipped(a, b, c, Relative(*clip, 1, origin))
             : ClippedMeasure{Length(Cross(b - a, c - a)) / 2, Dot(a, Cross(b, c)) / 6};
    double area = part.area;
    if (!volumes.sizes.empty()) {
      area *= (volumes.SizeOf(triangle[0]) + volumes.SizeOf(triangle[1]) +
               volumes.SizeOf(triangle[2])) /
              3;
    }
    volumes.measures[body].area += area;
    volumes.measures[body].volume += part.volume;
  }
  ShareMeasures(bodies, volumes);
}

void MatchVolumes(const Bodies& bodies, const VolumeStep& step, const std::vector<Vec3>& normals,
                  BodyVolumes& volumes, std::vector<Vec3>& positions) {
  const double per_unit = 1 / (step.unit * step.unit * step.unit);
  volumes.offsets.assign(bodies.bodies.size(), 0);
  for (std::size_t body = 0; body < bodies.bodies.size(); ++body) {
    const BodyMeasure& measure = volumes.measures[body];
    const double wanted = bodies.bodies[body].volume * per_unit;
    // Without particles, the volume that the body should have is unknown.
    if (!(wanted > 0) || !(measure.area > 0)) continue;
    const double missing = wanted - measure.volume;
    if (std::abs(missing) <= step.tolerance * wanted) continue;
    volumes.offsets[body] = std::clamp(missing / measure.area, -step.limit, step.limit);
  }
  ParallelFor(static_cast<std::uint32_t>(positions.size()), [&](std::uint32_t v) {
    const double offset = volumes.offsets[volumes.body_of[v]] * volumes.SizeOf(v);
    positions[v] = positions[v] + offset * normals[v];
  });
}

void BeginSearch(const Bodies& bodies, const std::vector<Vec3>& positions,
                 std::span<const std::uint8_t> is_settled, BodyVolumes& volumes) {
  volumes.best.assign(bodies.bodies.size(), {});
  for (std::size_t body = 0; body < is_settled.size(); ++body) {
    volumes.best[body].is_final = is_settled[body] != 0;
  }
  volumes.best_positions.resize(positions.size());
}

bool SearchVolumes(const Bodies& bodies, const VolumeStep& step, const std::vector<Vec3>& normals,
                   BodyVolumes& volumes, std::vector<Vec3>& positions) {
  volumes.offsets.assign(bodies.bodies.size(), 0);
  volumes.steps.assign(bodies.bodies.size(), BodyStep::kGoesOn);
  bool has_moved = false;
  for (std::size_t body = 0; body < bodies.bodies.size(); ++body) {
    const BodyMeasure& measure = volumes.measures[body];
    BodyVolumes::Best& best = volumes.best[body];
    const double wanted = bodies.bodies[body].volume;
    if (best.is_final || !(wanted > 0) || !(measure.area > 0)) continue;
    const double missing = wanted - measure.volume, error = std::abs(missing) / wanted;
    if (error > best.error) {
      volumes.steps[body] = BodyStep::kReturns;
      best.is_final = has_moved = true;
      continue;
    }
    volumes.steps[body] = BodyStep::kIsSaved;
    best.error = error;
    if (error <= step.tolerance) continue;
    volumes.offsets[body] = std::clamp(missing / measure.area, -step.limit, step.limit);
    has_moved = has_moved || volumes.offsets[body] != 0;
  }
  ParallelFor(static_cast<std::uint32_t>(positions.size()), [&](std::uint32_t v) {
    const std::uint32_t body = volumes.body_of[v];
    if (volumes.steps[body] == BodyStep::kReturns) {
      positions[v] = volumes.best_positions[v];
      return;
    }
    if (volumes.steps[body] == BodyStep::kIsSaved) volumes.best_positions[v] = positions[v];
    positions[v] = positions[v] + volumes.offsets[body] * volumes.SizeOf(v) * normals[v];
  });
  return has_moved;
}

}  // namespace partiemc::space
