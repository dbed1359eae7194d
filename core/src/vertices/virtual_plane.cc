#include "vertices/virtual_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "base/prefetch.h"
#include "core/internal/research.h"
#include "sampler/query_batch.h"
#include "vertices/placement.h"
#include "vertices/plane_support.h"
#include "vertices/ring_filters.h"

namespace partiemc {
namespace {

// Prefetch distance for planes, in segments.
constexpr std::size_t kFetchedAhead = 24;

double Dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y; }

VertexNormal UnitOf(const Point& v) {
  const double square = Dot(v, v);
  if (square < kWeakGradientSquare * kWeakGradientSquare) return {1, 0};
  const double inverse = 1 / std::sqrt(square);
  return {static_cast<float>(v.x * inverse), static_cast<float>(v.y * inverse)};
}

// Moves `point`, with the given value and gradient of F, by one Newton step towards F = 0, by at
// most `max_step` cells. Returns `point` if the gradient is weak.
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

// Finds the tile of a point in or near a cell. Usually this is the tile of the cell, which is
// indexed because it has an active cell.
FieldPoint Locate(const VertexInput& input, const ActiveCell& cell, const Point& point) {
  const Point origin = CellOrigin(input.bins.tiles, cell);
  const double x = point.x - origin.x + cell.i;
  const double y = point.y - origin.y + cell.j;
  if (x >= 0 && y >= 0 && x < kTileSize && y < kTileSize) return {cell.tile, x, y};
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const TilePlace place = Normalise(input.bins.tiles, cell.tile, i, j);
  const bool usable = place.tile != kNoTile && input.field.IsIndexed(place.tile);
  return {usable ? place.tile : kNoTile, place.i + (x - i), place.j + (y - j)};
}

// With grains: repeats the Newton step of a cell vertex, because the gradient changes within a
// cell. The vertex may leave its cell, because a grain may reach into a cell without a node in it.
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

// The local sizes of the vertices of a ring; empty for equal sizes.
std::span<const float> SizesOf(const RingVertices& v, std::size_t first, std::size_t count) {
  return v.size.empty() ? std::span<const float>() : std::span(v.size).subspan(first, count);
}

// Size of a ring with its margin; 0 vertices if the ring is too short for steps 2 and 3.
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

// Copies coordinates and normals into `ring`, and computes arc lengths and weights.
void CopyRing(const RingVertices& v, std::size_t first, const PeriodicRing& ring) {
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    ring.x[k] = RingUnits(v.point[first + k].x);
    ring.y[k] = RingUnits(v.point[first + k].y);
    ring.normal_x[k] = v.normal[first + k].x;
    ring.normal_y[k] = v.normal[first + k].y;
  }
  for (std::int32_t* values : {ring.x, ring.y}) ring.Repeat(values, 0, ring.count);
  for (float* values : {ring.normal_x, ring.normal_y}) ring.Repeat(values, 0, ring.count);
  MeasureArc(ring, SizesOf(v, first, static_cast<std::size_t>(ring.count)));
}

// Calls body(begin, end) for stretches of a ring, in parallel if the ring is long.
template <typename Body>
void ForEachStretch(const PeriodicRing& ring, Body body) {
  constexpr std::ptrdiff_t kStretch = 512;
  if (ring.count <= kStretch) {
    body(0, ring.count);
    return;
  }
  ParallelFor((ring.count + kStretch - 1) / kStretch, [&](std::ptrdiff_t stretch) {
    const std::ptrdiff_t begin = stretch * kStretch;
    body(begin, std::min(begin + kStretch, ring.count));
  });
}

// Step 2: averages normals along the ring, first by distance, then by distance and angle.
void SmoothNormals(const VertexInput& input, PeriodicRing& ring) {
  const VirtualPlaneConstants& c = input.variant.constants;
  for (const bool by_angle : {false, true}) {
    const double reach = (by_angle ? c.bilateral_reach : c.normal_reach) * input.scale.spacing;
    ForEachStretch(ring, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      MeanNormals(ring, begin, end, reach, by_angle);
      ring.Repeat(ring.next_x, begin, end);
      ring.Repeat(ring.next_y, begin, end);
    });
    std::swap(ring.normal_x, ring.next_x);
    std::swap(ring.normal_y, ring.next_y);
  }
}

// Mean of values along a ring, weighted by length.
double MeanOf(const PeriodicRing& ring, const float* values) {
  double sum = 0, weight = 0;
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    sum += double{ring.weight[k]} * values[k];
    weight += ring.weight[k];
  }
  return weight > 0 ? sum / weight : 0;
}

// Estimates the distance of the boundary above a plane, in cells, and the variance of the
// supporting particles' heights, in squared spacings. The distance is the mean height plus half a
// spacing, clamped to the support's height. Both are 0 if no particle supports the plane.
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
// the shape. A larger variance of the supporting particles reduces the weight of the estimates.
// Estimates and their mean are in units of the local size.
void ShiftPlanes(const VertexInput& input, std::size_t first_segment, PeriodicRing& ring,
                 const RingVertices& v) {
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
  const std::size_t first = 2 * first_segment;
  ForEachStretch(ring, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    MeanCurvature(ring, begin, end, c.curvature_reach * h);
    auto planes = CollectPoints<BentPlane>([&](std::span<const PointGroup<BentPlane>> groups) {
      std::array<QuerySupports, kQueriesAtOnce> sums;
      FindSupports(input.field, support, groups, sums);
      for (std::size_t q = 0; q < groups.size(); ++q) {
        for (std::size_t of = 0; of < groups[q].count; ++of) {
          const std::size_t i = groups[q].vertices[of];
          const auto [offset, variance] = EstimateOf(sums[q][of], support);
          ring.shift[i] =
              static_cast<float>(offset) - static_cast<float>(ring.base[i] / v.SizeOf(first + i));
          scatter[i] = static_cast<float>(variance);
        }
      }
    });
    // Each segment has two vertices.
    for (std::ptrdiff_t k = begin; k < end; k += 2) {
      if (BeginsGroup(k / 2)) planes.Part();
      const ActiveCell& cell = input.planes[first_segment + k / 2].cell;
      for (std::ptrdiff_t i = k; i < k + 2; ++i) {
        // A radius of curvature below one spacing is noise.
        const double size = v.SizeOf(first + i);
        const double sharpest = 1 / (h * size);
        const double curvature = std::clamp<double>(ring.shift[i], -sharpest, sharpest);
        ring.base[i] = steps.curvature ? static_cast<float>(rounding * size * size * curvature) : 0;
        // Stays so if no particle supports the plane.
        ring.shift[i] = static_cast<float>(-ring.base[i] / size);
        scatter[i] = 0;
        if (!steps.support) continue;
        const FieldPoint at = Locate(input, cell, v.point[first + i]);
        if (at.tile == kNoTile) continue;
        planes.Add(i, at.tile,
                   {.x = at.x,
                    .y = at.y,
                    .normal_x = ring.normal_x[i],
                    .normal_y = ring.normal_y[i],
                    .curvature = curvature,
                    .size = size});
      }
    }
    planes.Finish();
  });
  if (steps.support) {
    const double mean = MeanOf(ring, ring.shift);
    const double trust = c.support_scatter / (c.support_scatter + MeanOf(ring, scatter));
    for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
      ring.base[k] += static_cast<float>(trust * (ring.shift[k] - mean) * v.SizeOf(first + k));
    }
  }
  ring.Repeat(ring.base, 0, ring.count);
}

// End of step 3: moves every vertex along its normal to the weighted mean of its neighbours'
// planes. A circle does not change, since the mean normal of two of its points is perpendicular to
// their chord.
void SmoothPositions(const VertexInput& input, std::size_t first, const PeriodicRing& ring,
                     RingVertices& v) {
  const double reach = input.variant.constants.smoothing_reach * input.scale.spacing;
  ForEachStretch(ring, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    if (input.variant.steps.smoothing) {
      MeanShift(ring, begin, end, reach);
    } else {
      std::copy(ring.base + begin, ring.base + end, ring.shift + begin);
    }
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      v.normal[first + k] = {ring.normal_x[k], ring.normal_y[k]};
      Point& point = v.point[first + k];
      point.x += double{ring.shift[k]} * ring.normal_x[k];
      point.y += double{ring.shift[k]} * ring.normal_y[k];
    }
  });
}

// Steps 2 and 3 for a ring.
void RefineRing(const VertexInput& input, std::size_t r, PeriodicRing ring, RingVertices& v) {
  const std::size_t first_segment = input.topology.offsets[r];
  CopyRing(v, 2 * first_segment, ring);
  if (input.variant.steps.normals) SmoothNormals(input, ring);
  ShiftPlanes(input, first_segment, ring, v);
  SmoothPositions(input, 2 * first_segment, ring, v);
}

// Drops edge vertices that lie nearly on the chord of the neighbouring cell vertices.
void Thin(const VertexInput& input, std::size_t ring, RingVertices& v) {
  const double min_distance = input.variant.constants.thinning_distance * input.scale.spacing;
  const std::size_t first = 2 * std::size_t{input.topology.offsets[ring]};
  const std::size_t last = 2 * std::size_t{input.topology.offsets[ring + 1]};
  for (std::size_t k = first; k < last; k += 2) {
    const Point& a = v.point[(k == first ? last : k) - 1];
    const Point& p = v.point[k];
    const Point& b = v.point[k + 1];
    const Point chord{b.x - a.x, b.y - a.y};
    const double cross = chord.x * (p.y - a.y) - chord.y * (p.x - a.x);
    v.is_kept[k] = input.variant.steps.edge_vertices &&
                   std::abs(cross) >= min_distance * v.SizeOf(k) * std::sqrt(Dot(chord, chord));
    v.is_kept[k + 1] = 1;
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
  PeriodicRings& periodic = vertices.periodic_rings;
  periodic.sizes().assign(topology.RingCount(), {});
  // A task computes all steps of a short ring, so that its data stay in the cache.
  ParallelFor(topology.RingCount(), [&](std::size_t ring) {
    FindRingRoots(input, ring, vertices);
    const PeriodicRings::Size size = SizeOf(input, ring, vertices);
    if (size.count > 0 && !ShortRing::Holds(size)) {
      periodic.sizes()[ring] = size;
      return;
    }
    if (size.count > 0) {
      ShortRing memory;
      RefineRing(input, ring, memory.Of(size), vertices);
    }
    Thin(input, ring, vertices);
  });
  periodic.Allocate();
  ParallelFor(topology.RingCount(), [&](std::size_t ring) {
    if (periodic.sizes()[ring].count == 0) return;
    RefineRing(input, ring, periodic[ring], vertices);
    Thin(input, ring, vertices);
  });
}

}  // namespace partiemc
