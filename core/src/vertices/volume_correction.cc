#include "vertices/volume_correction.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/point.h"
#include "core/internal/research.h"
#include "vertices/measure.h"

namespace partiemc {
namespace {

// Longest mitre, as a multiple of the offset.
constexpr double kMaxMitre = 2;

// Sum of the volumes of the particles of an outer ring's component, in squared cells.
double VolumeOf(const VertexInput& input, std::size_t ring) {
  if (input.frame.volumes.empty()) {
    const double each = input.scale.spacing * input.scale.spacing;
    return static_cast<double>(input.topology.particle_count[ring]) * each;
  }
  return input.topology.particle_weight[ring] / input.scale.weight_per_volume;
}

// Sums term(length, mean of the values of both points) over the segments of a ring. `by_point`:
// values.
template <typename Term>
double SumOverSegments(std::span<const double> points, std::span<const float> by_point, Term term) {
  double sum = 0;
  for (std::size_t k = 0; k < by_point.size(); ++k) {
    const std::size_t next = k + 1 < by_point.size() ? k + 1 : 0;
    const Point from = PointAt(points, k), to = PointAt(points, next);
    const double x = to.x - from.x, y = to.y - from.y;
    sum += term(std::sqrt(x * x + y * y), (double{by_point[k]} + by_point[next]) / 2);
  }
  return sum;
}

// The length of a ring; each segment counts times its factor.
double WeightedLength(std::span<const double> points, std::span<const float> factors) {
  return SumOverSegments(points, factors,
                         [](double length, double factor) { return length * factor; });
}

// The length of a ring; each segment counts divided by the local size.
double LengthInLocalSizes(std::span<const double> points, std::span<const float> sizes) {
  return SumOverSegments(points, sizes, [](double length, double size) { return length / size; });
}

// The values of a ring; empty if `by_point` is empty.
std::span<const float> OfRing(const Rings& rings, std::size_t ring,
                              std::span<const float> by_point) {
  if (by_point.empty()) return {};
  return by_point.subspan(rings.offsets[ring], rings.offsets[ring + 1] - rings.offsets[ring]);
}

struct RingPart {
  bool counts;
  double area, perimeter;  // Each segment of the perimeter counts times its factor of the offset.
};

// The part of a ring that counts. If the body will be cut, this is the part in the window: the rest
// surrounds copies of its particles. `factors`: of the points of the ring, or empty.
RingPart PartOf(const VertexInput& input, const Rings& rings, std::size_t ring,
                std::span<const float> factors) {
  const RingMeasures& whole = rings.measures[ring];
  const auto points = rings.RingPoints(ring);
  if (input.percolation != nullptr && input.percolation->IsCut(input.topology, ring)) {
    const WindowMeasures part = MeasureInWindow(points, input.percolation->window, factors);
    return {true, part.area, part.perimeter};
  }
  const bool is_gone =
      input.percolation != nullptr && input.percolation->IsGone(input.topology, ring);
  return {!is_gone, whole.area,
          factors.empty() ? whole.perimeter : WeightedLength(points, factors)};
}

// The target of the offset for this frame, in spacings; empty if no component is long enough.
std::optional<double> TargetOf(const VertexInput& input, const PointSizes& sizes, double spacing,
                               Rings& rings) {
  const VirtualPlaneConstants& constants = input.variant.constants;
  MeasureRings(rings);
  double volume = 0, area = 0, perimeter = 0;
  const auto length_in_sizes = [&](std::size_t ring) {
    return !input.scale.has_own_sizes
               ? rings.measures[ring].perimeter
               : LengthInLocalSizes(rings.RingPoints(ring), OfRing(rings, ring, sizes.local));
  };
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const bool is_outer = rings.outer_of[ring] == kNoRing;
    const std::size_t outer = is_outer ? ring : rings.outer_of[ring];
    // Spray does not count: its area depends on how it broke off.
    if (length_in_sizes(outer) < constants.ShortestRing() * spacing) continue;
    const auto [counts, ring_area, ring_perimeter] =
        PartOf(input, rings, ring, OfRing(rings, ring, sizes.factors));
    if (!counts) continue;
    if (is_outer) volume += VolumeOf(input, ring);
    area += ring_area;
    perimeter += ring_perimeter;
  }
  if (perimeter <= 0) return std::nullopt;
  volume *= input.scale.cell_size * input.scale.cell_size;
  return std::clamp((volume - area) / perimeter / spacing, -constants.area_limit,
                    constants.area_limit);
}

}  // namespace

void OffsetRing(std::span<const double> points, std::span<const float> factors, double offset,
                double* target) {
  // Unit normal to the right of the segment between two points; 0 if they are equal.
  const auto normal_of = [](const Point& from, const Point& to) {
    const Point normal{to.y - from.y, from.x - to.x};
    const double length = std::sqrt(normal.x * normal.x + normal.y * normal.y);
    return length > 0 ? Point{normal.x / length, normal.y / length} : normal;
  };
  const std::size_t count = points.size() / 2;
  Point point = PointAt(points, 0);
  Point before = normal_of(PointAt(points, count - 1), point);
  for (std::size_t k = 0; k < count; ++k) {
    const Point next = PointAt(points, k + 1 < count ? k + 1 : 0);
    const Point after = normal_of(point, next);
    // For unit normals a and b, the mitre (a + b) / (1 + a . b) has the length 1 / cos(half the
    // turn).
    const double divisor =
        std::max(1 + before.x * after.x + before.y * after.y, 2 / (kMaxMitre * kMaxMitre));
    const double own = factors.empty() ? offset : offset * factors[k];
    target[2 * k] = point.x + own * (before.x + after.x) / divisor;
    target[2 * k + 1] = point.y + own * (before.y + after.y) / divisor;
    point = next;
    before = after;
  }
}

void CorrectVolume(const VertexInput& input, const PointSizes& sizes, std::vector<double>& scratch,
                   std::optional<double>& offset, Rings& rings) {
  const bool is_known = input.parameters.spacing.has_value() || !input.frame.volumes.empty();
  if (!is_known || !input.variant.steps.area) return;
  const double spacing = input.scale.spacing * input.scale.cell_size;
  if (const std::optional<double> target = TargetOf(input, sizes, spacing, rings)) {
    const double change = input.variant.constants.area_change;
    offset = offset ? std::clamp(*target, *offset - change, *offset + change) : *target;
  }
  if (!offset) return;
  scratch.resize(rings.points.size());
  ParallelFor(rings.RingCount(), [&](std::size_t ring) {
    OffsetRing(rings.RingPoints(ring), OfRing(rings, ring, sizes.factors), *offset * spacing,
               scratch.data() + 2 * std::size_t{rings.offsets[ring]});
  });
  std::swap(rings.points, scratch);
}

}  // namespace partiemc
