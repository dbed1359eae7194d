#include "vertices/virtual_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "base/cancellation.h"
#include "base/parallel.h"
#include "base/point.h"
#include "base/prefetch.h"
#include "core/internal/research.h"
#include "sampler/query_batch.h"
#include "vertices/placement.h"
#include "vertices/plane_support.h"
#include "vertices/ring_filters.h"
#include "vertices/stretches.h"
#include "vertices/thinning.h"

namespace partiemc {
namespace {

// Prefetch distance for planes, in segments.
constexpr std::size_t kFetchedAhead = 24;

VertexNormal UnitOf(const Point& v) {
  const double square = Dot(v, v);
  if (square < kWeakGradientSquare * kWeakGradientSquare) return {1, 0};
  const double inverse = 1 / std::sqrt(square);
  return {static_cast<float>(v.x * inverse), static_cast<float>(v.y * inverse)};
}

// Moves `point` towards F = 0 by one Newton step of at most `max_step` cells. `value` and
// `gradient`: of F at the point. Returns `point` if the gradient is weak.
Point NewtonStep(Point point, double value, Point gradient, double max_step) {
  const double square = Dot(gradient, gradient);
  if (square < kWeakGradientSquare) return point;
  double step = -value / square;
  // The step has the length |step| |gradient|.
  if (step * step * square > max_step * max_step) {
    step = std::copysign(max_step / std::sqrt(square), step);
  }
  return {point.x + step * gradient.x, point.y + step * gradient.y};
}

// The tile of a point in or near an active cell, and the point relative to it; kNoTile if the
// sampler has not indexed the tile. Usually this is the tile of the cell, which is indexed.
FieldPoint Locate(const VertexInput& input, const ActiveCell& cell, const Point& point) {
  const Point origin = CellOrigin(input.bins.tiles, cell);
  const double x = point.x - origin.x + cell.i;
  const double y = point.y - origin.y + cell.j;
  if (x >= 0 && y >= 0 && x < kTileSize && y < kTileSize) return {cell.tile, x, y};
  // Contacts may be far from their cells.
  if (!(x >= -kTileSize && y >= -kTileSize && x < 2 * kTileSize && y < 2 * kTileSize)) return {};
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const TilePlace place = Normalise(input.bins.tiles, cell.tile, i, j);
  const bool usable = place.tile != kNoTile && input.field.IsIndexed(place.tile);
  return {usable ? place.tile : kNoTile, place.i + (x - i), place.j + (y - j)};
}

// With grains: repeats the Newton step of cell vertex i, because the gradient changes within a
// cell. The vertex may leave its cell: a grain may reach into a cell without a node in it.
void ApproachGrain(const VertexInput& input, const CellPlane& plane, std::size_t i,
                   RingVertices& v) {
  constexpr int kSteps = 3;
  constexpr double kTolerance = 1e-4;  // Of F, in cells.
  const double max_step = input.variant.constants.newton_step;
  v.point[i] = VirtualPlaneVertex(plane, max_step);
  for (int step = 1; step < kSteps; ++step) {
    const FieldPoint at = Locate(input, plane.cell, v.point[i]);
    if (at.tile == kNoTile) return;
    const FieldSample sample = input.field.Sample(at.tile, at.x, at.y);
    const Point gradient{sample.gradient_x, sample.gradient_y};
    if (Dot(gradient, gradient) < kWeakGradientSquare) return;
    v.normal[i] = UnitOf(gradient);
    if (std::abs(sample.value) < kTolerance) return;
    v.point[i] = NewtonStep(v.point[i], sample.value, gradient, max_step);
  }
}

// Step 1 for a segment: moves both vertices to the level set by one Newton step each. Near the
// surface F behaves like a distance, so a short step along the gradient does not change the
// gradient. The normal is therefore taken at the starting point unless the step exceeds
// `long_step`.
void FindRoots(const VertexInput& input, std::size_t segment, RingVertices& v) {
  const VirtualPlaneConstants& constants = input.variant.constants;
  const CellPlane& plane = input.planes[segment];
  const std::size_t edge = 2 * segment;
  const std::size_t inner = edge + 1;
  v.root[edge] = plane.entry;
  v.point[edge] =
      NewtonStep(plane.entry, plane.entry_value, {plane.entry_gradient_x, plane.entry_gradient_y},
                 constants.newton_step);
  v.root[inner] = v.point[inner] = ClampToCell(
      input.bins.tiles, plane.cell, input.crossings.segments[input.topology.segments[segment]],
      VirtualPlaneVertex(plane, constants.newton_step));
  const auto set_normal = [&](std::size_t i, const Point& from, Point gradient) {
    const Point step{v.point[i].x - from.x, v.point[i].y - from.y};
    if (Dot(step, step) > constants.long_step * constants.long_step) {
      const FieldPoint at = Locate(input, plane.cell, v.point[i]);
      const FieldSample sample =
          at.tile == kNoTile ? FieldSample{} : input.field.Sample(at.tile, at.x, at.y);
      gradient = {sample.gradient_x, sample.gradient_y};
    }
    v.normal[i] = Dot(gradient, gradient) >= kWeakGradientSquare
                      ? UnitOf(gradient)
                      : UnitOf({plane.OutwardX(), plane.OutwardY()});
  };
  set_normal(edge, plane.entry, {plane.entry_gradient_x, plane.entry_gradient_y});
  set_normal(inner, plane.point, {plane.gradient_x, plane.gradient_y});
  if (input.scale.has_grains) ApproachGrain(input, plane, inner, v);
  if (v.size.empty()) return;
  v.size[edge] = plane.entry_size;
  v.size[inner] = plane.size;
}

// All vertices of a ring.
struct ClosedRun {
  const RingVertices& v;
  std::size_t first;  // Even.
  std::ptrdiff_t count;

  std::size_t VertexAt(std::ptrdiff_t k) const { return first + static_cast<std::size_t>(k); }
  const Point& PointAt(std::ptrdiff_t k) const { return v.point[VertexAt(k)]; }
  const VertexNormal& NormalAt(std::ptrdiff_t k) const { return v.normal[VertexAt(k)]; }
  double SizeAt(std::ptrdiff_t k) const { return v.SizeOf(VertexAt(k)); }
  // Number of points before the points repeat (OpenRun).
  std::ptrdiff_t OwnCount() const { return count; }
  bool HasVertex(std::ptrdiff_t) const { return true; }
};

// A free stretch between walls with its continuations, as a ring. The ring runs along the points
// and back; it has both end points once and all other points twice.
struct OpenRun {
  std::span<const StretchPoint> points;

  const StretchPoint& Of(std::ptrdiff_t k) const {
    const auto at = static_cast<std::size_t>(k);
    return points[at < points.size() ? at : 2 * points.size() - 2 - at];
  }
  std::size_t VertexAt(std::ptrdiff_t k) const { return Of(k).vertex; }
  const Point& PointAt(std::ptrdiff_t k) const { return Of(k).point; }
  const VertexNormal& NormalAt(std::ptrdiff_t k) const { return Of(k).normal; }
  double SizeAt(std::ptrdiff_t k) const { return double{Of(k).size}; }
  std::ptrdiff_t OwnCount() const { return static_cast<std::ptrdiff_t>(points.size()); }
  bool HasVertex(std::ptrdiff_t k) const { return Of(k).vertex != kNoVertex; }
};

// The local sizes of the vertices of a ring; empty for equal sizes.
std::span<const float> SizesOf(const RingVertices& v, std::size_t first, std::size_t count) {
  return v.size.empty() ? std::span<const float>() : std::span(v.size).subspan(first, count);
}

// The size of a ring with its margin; 0 vertices if the ring is too short for steps 2 and 3.
PeriodicRings::Size SizeOf(const VertexInput& input, std::size_t ring, const RingVertices& v) {
  const std::size_t first = 2 * std::size_t{input.topology.offsets[ring]};
  const std::size_t count = 2 * std::size_t{input.topology.offsets[ring + 1]} - first;
  const auto length_after = [&](std::size_t k) {
    const std::size_t from = first + k;
    const std::size_t to = first + (k + 1 == count ? 0 : k + 1);
    const Point& a = v.point[from];
    const Point& b = v.point[to];
    const Point chord{b.x - a.x, b.y - a.y};
    return std::sqrt(Dot(chord, chord)) * 2 / (v.SizeOf(from) + v.SizeOf(to));
  };
  const double min_length = input.variant.constants.ShortestRing() * input.scale.spacing;
  double length = 0;
  for (std::size_t k = 0; k < count && length < min_length; ++k) length += length_after(k);
  if (length < min_length) return {};
  PeriodicRings::Size size = SizeForWindows(std::span(v.point).subspan(first, count),
                                            SizesOf(v, first, count), min_length / 2);
  size.margin += kWindowPadding;
  return size;
}

// The length of an open path. `sizes`: by point, the local size, by which lengths are divided;
// empty if all are 1.
double LengthOf(std::span<const Point> path, std::span<const float> sizes) {
  double length = 0;
  for (std::size_t k = 1; k < path.size(); ++k) {
    const Point chord{path[k].x - path[k - 1].x, path[k].y - path[k - 1].y};
    const double size = sizes.empty() ? 1 : (double{sizes[k - 1]} + sizes[k]) / 2;
    length += std::sqrt(Dot(chord, chord)) / size;
  }
  return length;
}

// Copies coordinates and normals into `ring`, and computes arc lengths and weights.
template <typename Run>
void CopyRing(std::span<const float> sizes, const Run& run, const PeriodicRing& ring) {
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    ring.x[k] = RingUnits(run.PointAt(k).x);
    ring.y[k] = RingUnits(run.PointAt(k).y);
    ring.normal_x[k] = run.NormalAt(k).x;
    ring.normal_y[k] = run.NormalAt(k).y;
  }
  for (std::int32_t* values : {ring.x, ring.y}) ring.Repeat(values, 0, ring.count);
  for (float* values : {ring.normal_x, ring.normal_y}) ring.Repeat(values, 0, ring.count);
  MeasureArc(ring, sizes);
}

// Calls body(begin, end) for ranges of the vertices [0, count), in parallel if there are many.
template <typename Body>
void ForEachRange(std::ptrdiff_t count, Body body) {
  constexpr std::ptrdiff_t kRange = 512;
  if (count <= kRange) {
    body(0, count);
    return;
  }
  ParallelFor((count + kRange - 1) / kRange, [&](std::ptrdiff_t range) {
    const std::ptrdiff_t begin = range * kRange;
    body(begin, std::min(begin + kRange, count));
  });
}

// Step 2: averages normals along the ring, first by distance, then by distance and angle.
void SmoothNormals(const VertexInput& input, PeriodicRing& ring) {
  const VirtualPlaneConstants& c = input.variant.constants;
  for (const bool by_angle : {false, true}) {
    const double reach = (by_angle ? c.bilateral_reach : c.normal_reach) * input.scale.spacing;
    ForEachRange(ring.count, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      MeanNormals(ring, begin, end, reach, by_angle);
      ring.Repeat(ring.next_x, begin, end);
      ring.Repeat(ring.next_y, begin, end);
    });
    std::swap(ring.normal_x, ring.next_x);
    std::swap(ring.normal_y, ring.next_y);
  }
}

// Mean of `values` at the vertices of a run, weighted by the arc length at each vertex
// (PeriodicRing::weight). 0 if the run has no vertices.
template <typename Run>
double MeanOf(const Run& run, const PeriodicRing& ring, const float* values) {
  double sum = 0, weight = 0;
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    if (!run.HasVertex(k)) continue;
    sum += double{ring.weight[k]} * values[k];
    weight += ring.weight[k];
  }
  return weight > 0 ? sum / weight : 0;
}

// The height of the boundary above a plane, in cells, and the variance of the supporting particles'
// heights, in squared spacings. The boundary is half a spacing above the mean height, clamped to
// +- the support's height. Both are 0 if no particle supports the plane.
std::pair<double, double> EstimateOf(const SupportSums& sums, const SupportShape& support) {
  if (!(sums.weight > 0)) return {};
  const double mean = sums.distance / sums.weight;
  const double variance = std::max(0.0, sums.square / sums.weight - mean * mean);
  return {std::clamp(mean + support.spacing / 2, -support.height, support.height),
          variance / (support.spacing * support.spacing)};
}

void FindSupports(const LevelSetSampler& field, const SupportShape& support,
                  std::span<const PointGroup<BentPlane>> groups, std::span<QuerySupports> sums) {
  std::array<SupportQuery, kQueriesAtOnce> queries;
  for (std::size_t q = 0; q < groups.size(); ++q) {
    queries[q].planes = std::span(groups[q].points).first(groups[q].count);
    double size = 0;
    for (const BentPlane& plane : queries[q].planes) size = std::max(size, plane.size);
    field.FindNear(groups[q].tile, queries[q].planes,
                   {(support.radius + support.lift) * size, support.lift}, queries[q].near);
  }
  SumSupports(std::span(queries).first(groups.size()), support, sums);
}

// Step 3: computes the shift `base` of each vertex's plane along its normal. The mean of the
// estimates along the ring is subtracted: it depends on the arrangement of the particles, not on
// the shape. A larger variance of the supporting particles' heights reduces the weight of the
// estimates. Estimates, their mean and `shift` are divided by the local size.
template <typename Run>
void ShiftPlanes(const VertexInput& input, const Run& run, PeriodicRing& ring) {
  const double h = input.scale.spacing;
  const VirtualPlaneSteps& steps = input.variant.steps;
  const VirtualPlaneConstants& c = input.variant.constants;
  const double lift = input.scale.has_own_sizes ? h / 2 : 0;
  const SupportShape support{
      // The sampler finds particles within the kernel radius.
      .radius = std::min(c.support_radius * h, input.scale.kernel_radius - lift),
      .lift = lift,
      .height = c.support_height * h,
      .spacing = h,
      .depth = c.support_depth};
  // The kernel moves a boundary of curvature kappa inward by R^2 kappa / 18.
  const double rounding = c.rounding * input.scale.kernel_radius * input.scale.kernel_radius / 9;
  float* scatter = ring.next_x;
  ForEachRange(run.OwnCount(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    MeanCurvature(ring, begin, end, c.curvature_reach * h);
    auto planes = CollectPoints<BentPlane>([&](std::span<const PointGroup<BentPlane>> groups) {
      std::array<QuerySupports, kQueriesAtOnce> sums;
      FindSupports(input.field, support, groups, sums);
      for (std::size_t q = 0; q < groups.size(); ++q) {
        for (std::size_t of = 0; of < groups[q].count; ++of) {
          const std::size_t i = groups[q].vertices[of];
          const auto [offset, variance] = EstimateOf(sums[q][of], support);
          ring.shift[i] =
              static_cast<float>(offset) - static_cast<float>(ring.base[i] / run.SizeAt(i));
          scatter[i] = static_cast<float>(variance);
        }
      }
    });
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      // Each segment has two vertices.
      if (k % 2 == 0 && BeginsGroup(static_cast<std::size_t>(k / 2))) planes.Part();
      // A radius of curvature below one spacing is noise.
      const double size = run.SizeAt(k);
      const double sharpest = 1 / (h * size);
      const double curvature = std::clamp<double>(ring.shift[k], -sharpest, sharpest);
      ring.base[k] = steps.curvature ? static_cast<float>(rounding * size * size * curvature) : 0;
      // These values remain if no particle can support the plane.
      ring.shift[k] = static_cast<float>(-ring.base[k] / size);
      scatter[k] = 0;
      if (!steps.support || !run.HasVertex(k)) continue;
      const std::size_t i = run.VertexAt(k);
      const FieldPoint at = Locate(input, input.planes[i / 2].cell, run.PointAt(k));
      if (at.tile == kNoTile) continue;
      planes.Add(static_cast<std::size_t>(k), at.tile,
                 {.x = at.x,
                  .y = at.y,
                  .normal_x = ring.normal_x[k],
                  .normal_y = ring.normal_y[k],
                  .curvature = curvature,
                  .size = size});
    }
    planes.Finish();
  });
  for (std::ptrdiff_t k = run.OwnCount(); k < ring.count; ++k) {
    const std::ptrdiff_t own = 2 * run.OwnCount() - 2 - k;
    ring.base[k] = ring.base[own];
    ring.shift[k] = ring.shift[own];
    scatter[k] = scatter[own];
  }
  if (steps.support) {
    const double mean = MeanOf(run, ring, ring.shift);
    const double trust = c.support_scatter / (c.support_scatter + MeanOf(run, ring, scatter));
    for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
      if (!run.HasVertex(k)) continue;
      ring.base[k] += static_cast<float>(trust * (ring.shift[k] - mean) * run.SizeAt(k));
    }
  }
  ring.Repeat(ring.base, 0, ring.count);
}

// End of step 3: moves every vertex along its normal to the weighted mean of its neighbours'
// planes. A circle does not change, since the mean normal of two of its points is perpendicular to
// their chord.
template <typename Run>
void SmoothPositions(const VertexInput& input, const Run& run, const PeriodicRing& ring,
                     RingVertices& v) {
  const double reach = input.variant.constants.smoothing_reach * input.scale.spacing;
  ForEachRange(run.OwnCount(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    if (input.variant.steps.smoothing) {
      MeanShift(ring, begin, end, reach);
    } else {
      std::copy(ring.base + begin, ring.base + end, ring.shift + begin);
    }
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      if (!run.HasVertex(k)) continue;
      v.normal[run.VertexAt(k)] = {ring.normal_x[k], ring.normal_y[k]};
      Point& point = v.point[run.VertexAt(k)];
      point.x += double{ring.shift[k]} * ring.normal_x[k];
      point.y += double{ring.shift[k]} * ring.normal_y[k];
    }
  });
}

// Steps 2 and 3 for a ring, or for a free stretch of one.
template <typename Run>
void RefineRun(const VertexInput& input, std::span<const float> sizes, const Run& run,
               PeriodicRing ring, RingVertices& v) {
  CopyRing(sizes, run, ring);
  if (input.variant.steps.normals) SmoothNormals(input, ring);
  ShiftPlanes(input, run, ring);
  SmoothPositions(input, run, ring, v);
}

void RefineRing(const VertexInput& input, std::size_t r, const PeriodicRing& ring,
                RingVertices& v) {
  const std::size_t first = 2 * std::size_t{input.topology.offsets[r]};
  RefineRun(input, SizesOf(v, first, static_cast<std::size_t>(ring.count)),
            ClosedRun{v, first, ring.count}, ring, v);
}

// Steps 2 and 3 for the free stretches of rings that meet walls. Skips stretches that are too short
// for windows.
void RefineStretches(const VertexInput& input, RingVertices& v) {
  const double min_length = input.variant.constants.ShortestRing() * input.scale.spacing;
  PeriodicRings& memory = v.periodic_rings;
  for (std::size_t ring = 0; ring < input.topology.RingCount(); ++ring) {
    if (v.meets_wall[ring] == 0) continue;
    ThrowIfCancelled();
    ForEachStretch(input, ring, min_length / 2, v, [&] {
      const OpenRun run{v.stretch};
      v.stretch_path.clear();
      v.stretch_sizes.clear();
      for (std::ptrdiff_t k = 0; k < 2 * run.OwnCount() - 2; ++k) {
        v.stretch_path.push_back(run.PointAt(k));
        if (input.scale.has_own_sizes) v.stretch_sizes.push_back(run.Of(k).size);
      }
      if (LengthOf(v.stretch_path, v.stretch_sizes) < min_length) return;
      PeriodicRings::Size size = SizeForWindows(v.stretch_path, v.stretch_sizes, min_length / 2);
      size.margin += kWindowPadding;
      memory.sizes().assign(1, size);
      memory.Allocate();
      RefineRun(input, v.stretch_sizes, run, memory[0], v);
    });
  }
}

// Step 1 for a ring.
void FindRingRoots(const VertexInput& input, std::size_t ring, RingVertices& v) {
  const std::size_t begin = input.topology.offsets[ring];
  ParallelForRanges(input.topology.offsets[ring + 1] - begin, kSegmentsAtOnce,
                    [&](std::size_t first, std::size_t last) {
                      for (std::size_t k = begin + first; k < begin + last; ++k) {
                        if (k + kFetchedAhead < input.planes.size()) {
                          PrefetchLines(std::span(input.planes).subspan(k + kFetchedAhead, 1));
                        }
                        FindRoots(input, k, v);
                      }
                    });
}

}  // namespace

Point VirtualPlaneVertex(const CellPlane& plane, double max_step) {
  if (plane.is_weak) return plane.point;
  return NewtonStep(plane.point, plane.value, {plane.gradient_x, plane.gradient_y}, max_step);
}

void PlaceOnVirtualPlanes(const VertexInput& input, RingVertices& vertices) {
  const RingTopology& topology = input.topology;
  vertices.Resize(2 * topology.segments.size(), input.scale.has_own_sizes);
  if (input.walls != nullptr) {
    vertices.walls.Resize(vertices.point.size());
    vertices.meets_wall.assign(topology.RingCount(), 0);
  }
  PeriodicRings& periodic = vertices.periodic_rings;
  periodic.sizes().assign(topology.RingCount(), {});
  // A task computes all steps of a short ring, so that its data stay in the cache.
  ParallelFor(topology.RingCount(), [&](std::size_t ring) {
    FindRingRoots(input, ring, vertices);
    if (input.walls != nullptr && FindWallVertices(input, ring, vertices)) {
      vertices.meets_wall[ring] = 1;
      return;
    }
    const PeriodicRings::Size size = SizeOf(input, ring, vertices);
    if (size.count > 0 && !ShortRing::Holds(size)) {
      periodic.sizes()[ring] = size;
      return;
    }
    if (size.count > 0) {
      ShortRing memory;
      RefineRing(input, ring, memory.Of(size), vertices);
    }
    ThinRing(input, ring, vertices);
  });
  periodic.Allocate();
  ParallelFor(topology.RingCount(), [&](std::size_t ring) {
    if (periodic.sizes()[ring].count == 0) return;
    RefineRing(input, ring, periodic[ring], vertices);
    ThinRing(input, ring, vertices);
  });
  if (input.walls == nullptr) return;
  RefineStretches(input, vertices);
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    if (vertices.meets_wall[ring] != 0) ThinRing(input, ring, vertices);
  }
}

}  // namespace partiemc
