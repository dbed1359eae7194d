#include "virtual_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "parallel.h"
#include "placement.h"
#include "plane_estimates.h"
#include "point_groups.h"
#include "prefetch.h"
#include "ring_windows.h"

namespace partiemc {
namespace {

// Longest Newton step of an edge crossing, in cells: it stays nearer to its edge than to the
// vertices of the cells beside it.
constexpr double kMaxEdgeStep = 0.3;

// Newton steps longer than this may cross from one branch of F to another, in cells: at corners and
// where bodies are near each other. The gradient is asked for again at their ends.
constexpr double kLongStep = 0.07;

// Segments between one and that whose memory is asked for.
constexpr std::size_t kAskedAhead = 24;

// Shorter rings stay at their roots: the windows below would meet their own ends.
// Where drops form and vanish, refining short ones costs more calm than it gains shape.
constexpr double kMinRefinedLength = 24;  // Spacings.
constexpr std::size_t kMinRefinedVertices = 24;

// Reaches of the windows along a ring, in spacings. Each was the best of a coarse scan on the
// tuning set; a factor of 1.5 either way changes no ratio by more than a few percent.
constexpr double kNormalReach = 2.5;
constexpr double kBilateralReach = 6;
constexpr double kCurvatureReach = 1.5;
constexpr double kSmoothingReach = 2.5;
constexpr double kWidestReach =
    std::max({kNormalReach, kBilateralReach, kCurvatureReach, kSmoothingReach});
static_assert(2 * kWidestReach <= kMinRefinedLength, "a window must not meet its own end");

// The kernel rounds a boundary of curvature kappa off by about half of h^2 kappa, and fills it by
// more where it is concave: in a notch the particles of both flanks count.
constexpr double kRoundingPerConvexCurvature = 0.5;
constexpr double kRoundingPerConcaveCurvature = 1;
// Tighter bends than this are noise: no kernel resolves them. In 1 / spacings.
constexpr double kMaxCurvature = 0.6;

// A plane's own estimates are noisy: these shares of them are believed. The errors of the two are
// different ones, so that both together do better than any one.
constexpr float kSupportTrust = 0.35f;
constexpr float kStripTrust = 0.25f;
// Of a ring's mean strip, where volumes are known, in spacings; more is a sign that they are not
// the volumes of this outline.
constexpr double kMaxMeanStrip = 0.4;

// Edge vertices nearer than this to the chord of their neighbours say nothing, in spacings.
constexpr double kThinningDistance = 0.02;

double Dot(const LatticePoint& a, const LatticePoint& b) { return a.x * b.x + a.y * b.y; }

double Distance(const LatticePoint& a, const LatticePoint& b) {
  const LatticePoint chord{b.x - a.x, b.y - a.y};
  return std::sqrt(Dot(chord, chord));
}

VertexNormal UnitOf(const LatticePoint& v) {
  const double square = Dot(v, v);
  if (square < kWeakGradientSquare * kWeakGradientSquare) return {1, 0};
  const double inverse = 1 / std::sqrt(square);
  return {static_cast<float>(v.x * inverse), static_cast<float>(v.y * inverse)};
}

// A point beyond the sides of a tile, in cells relative to it.
FieldPoint LocateBeyond(const VertexInput& input, std::uint32_t tile, double x, double y) {
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const TilePlace place = Normalise(input.bins.tiles, tile, i, j);
  const bool usable = place.tile != kNoTile && input.field.IsIndexed(place.tile);
  return {usable ? place.tile : kNoTile, place.i + (x - i), place.j + (y - j)};
}

// Tells where points in or next to the cell of a segment are: in most cases in the tile of that.
class SegmentLocator {
 public:
  SegmentLocator(const VertexInput& input, std::size_t segment)
      : input_(input),
        cell_(input.planes[segment].cell),
        origin_(CellOrigin(input.bins.tiles, cell_)) {}

  FieldPoint Locate(const LatticePoint& point) const {
    const double x = point.x - origin_.x + cell_.i;
    const double y = point.y - origin_.y + cell_.j;
    if (!(x >= 0 && y >= 0 && x < kTileSize && y < kTileSize)) {
      return LocateBeyond(input_, cell_.tile, x, y);
    }
    return {cell_.tile, x, y};  // Indexed, as it has an active cell.
  }

 private:
  const VertexInput& input_;
  const ActiveCell& cell_;
  LatticePoint origin_;
};

// Step 1 of a segment: both vertices on the level set, by one Newton step each. Along its gradient
// that of a distance stays the same: unless a step is long, normals are those of the points that it
// begins at.
void FindRoots(const VertexInput& input, std::size_t segment, RingVertices& v) {
  const CellPlane& plane = input.planes[segment];
  const std::size_t edge = 2 * segment;
  const std::size_t inner = edge + 1;
  v.root[edge] = plane.entry;
  v.point[edge] = NewtonStep(plane.entry, plane.entry_value,
                             {plane.entry_gradient_x, plane.entry_gradient_y}, kMaxEdgeStep);
  v.root[inner] = v.point[inner] = ClampToCell(
      input.bins.tiles, plane.cell, input.crossings.segments[input.topology.segments[segment]],
      VirtualPlaneVertex(plane));
  const auto set_normal = [&](std::size_t i, const LatticePoint& from, LatticePoint gradient) {
    const LatticePoint step{v.point[i].x - from.x, v.point[i].y - from.y};
    if (Dot(step, step) > kLongStep * kLongStep) {
      const FieldPoint at = SegmentLocator(input, segment).Locate(v.point[i]);
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
}

// Step 1 of a ring.
void FindRingRoots(const VertexInput& input, std::size_t ring, RingVertices& v) {
  const std::size_t begin = input.topology.offsets[ring];
  const std::size_t count = input.topology.offsets[ring + 1] - begin;
  const auto find = [&](std::size_t first, std::size_t last) {
    for (std::size_t k = begin + first; k < begin + last; ++k) {
      if (const std::size_t later = k + kAskedAhead; later < input.planes.size()) {
        PrefetchLines(std::span(input.planes).subspan(later, 1));
      }
      FindRoots(input, k, v);
    }
  };
  count <= kSegmentsAtOnce ? find(0, count) : ParallelForRanges(count, kSegmentsAtOnce, find);
}

// Numbers of vertices and margin of a ring: none for a ring that stays at its roots.
UnrolledRings::Size SizeOf(const VertexInput& input, std::size_t ring, const RingVertices& v) {
  const std::size_t first = 2 * std::size_t{input.topology.offsets[ring]};
  const std::size_t count = 2 * std::size_t{input.topology.offsets[ring + 1]} - first;
  if (count < kMinRefinedVertices) return {};
  const auto length_after = [&](std::size_t k) {
    return Distance(v.point[first + k], v.point[first + (k + 1 == count ? 0 : k + 1)]);
  };
  const double min_length = kMinRefinedLength * input.scale.spacing;
  double length = 0;
  for (std::size_t k = 0; k < count && length < min_length; ++k) length += length_after(k);
  if (length < min_length) return {};
  UnrolledRings::Size size =
      SizeForWindows(std::span(v.point).subspan(first, count), kWidestReach * input.scale.spacing);
  size.margin += kWindowPadding;
  return size;
}

// Copies what the steps need, and measures the ring.
void Unroll(const RingVertices& v, std::size_t first, const UnrolledRing& ring) {
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    ring.x[k] = RingUnits(v.point[first + k].x);
    ring.y[k] = RingUnits(v.point[first + k].y);
    ring.normal_x[k] = v.normal[first + k].x;
    ring.normal_y[k] = v.normal[first + k].y;
  }
  for (std::int32_t* values : {ring.x, ring.y}) ring.Repeat(values, 0, ring.count);
  for (float* values : {ring.normal_x, ring.normal_y}) ring.Repeat(values, 0, ring.count);
  MeasureArc(ring);
}

// Calls body(begin, end) for stretches of a ring, in parallel where it is long.
template <typename Body>
void ForEachStretch(const UnrolledRing& ring, Body body) {
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

// Step 2: normals averaged along the ring, first by distance, then also by angle.
void SmoothNormals(const VertexInput& input, UnrolledRing& ring) {
  for (const bool by_angle : {false, true}) {
    const double reach = (by_angle ? kBilateralReach : kNormalReach) * input.scale.spacing;
    ForEachStretch(ring, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      MeanNormals(ring, begin, end, reach, by_angle);
      ring.Repeat(ring.next_x, begin, end);
      ring.Repeat(ring.next_y, begin, end);
    });
    std::swap(ring.normal_x, ring.next_x);
    std::swap(ring.normal_y, ring.next_y);
  }
}

// Whether particles have volumes that the outline should hold.
bool VolumesAreKnown(const VertexInput& input) {
  return input.parameters.spacing.has_value() || !input.frame.volumes.empty();
}

// How far the kernel has moved a boundary of this curvature inward.
double RoundingOf(double curvature, double spacing) {
  const double share = curvature > 0 ? kRoundingPerConvexCurvature : kRoundingPerConcaveCurvature;
  return share * spacing * spacing * curvature;
}

// Mean of a ring's values by length.
double MeanOf(const UnrolledRing& ring, const float* values) {
  double sum = 0, weight = 0;
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    sum += double{ring.weight[k]} * values[k];
    weight += ring.weight[k];
  }
  return weight > 0 ? sum / weight : 0;
}

// Step 3: how far each vertex's plane moves along its normal. Of the estimates only the variation
// along the ring counts: their means depend on how the particles are arranged, not on the shape.
// Where volumes are known, the mean of the strips is part of the truth.
void ShiftPlanes(const VertexInput& input, std::size_t first_segment, const UnrolledRing& ring,
                 const RingVertices& v) {
  const double h = input.scale.spacing;
  const double max_curvature = kMaxCurvature / h;
  const VirtualPlaneSteps& steps = input.parameters.steps;
  const PlaneEstimator estimator(input.field, input.scale);
  float* strips = ring.next_x;
  ForEachStretch(ring, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    MeanCurvature(ring, begin, end, kCurvatureReach * h);
    auto planes = CollectPoints<BentPlane>([&](std::span<const PlaneEstimator::Planes> groups) {
      std::array<PlaneEstimator::Estimates, kQueriesAtOnce> estimates;
      estimator.Estimate(groups, estimates);
      for (std::size_t q = 0; q < groups.size(); ++q) {
        for (std::size_t of = 0; of < groups[q].count; ++of) {
          const std::size_t i = groups[q].vertices[of];
          const auto [support, strip] = estimates[q][of];
          ring.shift[i] = kSupportTrust * (static_cast<float>(support) - ring.base[i]);
          strips[i] = kStripTrust * (static_cast<float>(strip) - ring.base[i]);
        }
      }
    });
    // Each segment has two vertices.
    for (std::ptrdiff_t k = begin; k < end; k += 2) {
      if (BeginsGroup(k / 2)) planes.Part();
      const SegmentLocator locator(input, first_segment + k / 2);
      for (std::ptrdiff_t i = k; i < k + 2; ++i) {
        const double curvature = std::clamp<double>(ring.shift[i], -max_curvature, max_curvature);
        ring.base[i] = steps.curvature ? static_cast<float>(RoundingOf(curvature, h)) : 0;
        // What is kept where nothing tells where a plane belongs.
        ring.shift[i] = steps.support ? kSupportTrust * -ring.base[i] : 0;
        strips[i] = steps.support ? kStripTrust * -ring.base[i] : 0;
        if (!steps.support) continue;
        const FieldPoint at = locator.Locate(v.point[2 * first_segment + i]);
        if (at.tile == kNoTile) continue;
        planes.Add(i, at.tile,
                   {.x = at.x,
                    .y = at.y,
                    .normal_x = ring.normal_x[i],
                    .normal_y = ring.normal_y[i],
                    .curvature = curvature});
      }
    }
    planes.Finish();
  });
  const double mean_strip = MeanOf(ring, strips);
  double mean = MeanOf(ring, ring.shift) + mean_strip;
  if (VolumesAreKnown(input)) {
    const double limit = kStripTrust * kMaxMeanStrip * h;
    mean -= std::clamp(mean_strip, -limit, limit);
  }
  for (std::ptrdiff_t k = 0; k < ring.count; ++k) {
    ring.base[k] += ring.shift[k] + strips[k] - static_cast<float>(mean);
  }
  ring.Repeat(ring.base, 0, ring.count);
}

// Step 4: every vertex to the weighted mean of what its neighbours' planes say, along its normal.
// A circle stays as it is: of two points of it, the mean normal is perpendicular to their chord.
void SmoothPositions(const VertexInput& input, std::size_t first, const UnrolledRing& ring,
                     RingVertices& v) {
  ForEachStretch(ring, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    if (input.parameters.steps.smoothing) {
      MeanShift(ring, begin, end, kSmoothingReach * input.scale.spacing);
    } else {
      std::copy(ring.base + begin, ring.base + end, ring.shift + begin);
    }
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      v.normal[first + k] = {ring.normal_x[k], ring.normal_y[k]};
      LatticePoint& point = v.point[first + k];
      point.x += double{ring.shift[k]} * ring.normal_x[k];
      point.y += double{ring.shift[k]} * ring.normal_y[k];
    }
  });
}

// Steps 2 to 4 of a ring.
void RefineRing(const VertexInput& input, std::size_t r, UnrolledRing ring, RingVertices& v) {
  const std::size_t first_segment = input.topology.offsets[r];
  Unroll(v, 2 * first_segment, ring);
  if (input.parameters.steps.normals) SmoothNormals(input, ring);
  ShiftPlanes(input, first_segment, ring, v);
  SmoothPositions(input, 2 * first_segment, ring, v);
}

// Step 5: drops edge vertices that lie on the chord of the cell vertices beside them.
void Thin(const VertexInput& input, std::size_t ring, RingVertices& v) {
  const double min_distance = kThinningDistance * input.scale.spacing;
  const std::size_t first = 2 * std::size_t{input.topology.offsets[ring]};
  const std::size_t last = 2 * std::size_t{input.topology.offsets[ring + 1]};
  for (std::size_t k = first; k < last; k += 2) {
    const LatticePoint& a = v.point[(k == first ? last : k) - 1];
    const LatticePoint& p = v.point[k];
    const LatticePoint& b = v.point[k + 1];
    const LatticePoint chord{b.x - a.x, b.y - a.y};
    const double cross = chord.x * (p.y - a.y) - chord.y * (p.x - a.x);
    v.is_kept[k] = input.parameters.steps.edge_vertices &&
                   std::abs(cross) >= min_distance * std::sqrt(Dot(chord, chord));
    v.is_kept[k + 1] = 1;
  }
}

}  // namespace

void PlaceOnVirtualPlanes(const VertexInput& input, RingVertices& vertices) {
  const RingTopology& topology = input.topology;
  vertices.Resize(2 * topology.segments.size());
  UnrolledRings& unrolled = vertices.unrolled;
  unrolled.sizes().assign(topology.RingCount(), {});
  // Short rings as a whole, one after the other: all that belongs to one stays in the cache.
  ParallelFor(topology.RingCount(), [&](std::size_t ring) {
    FindRingRoots(input, ring, vertices);
    const UnrolledRings::Size size = SizeOf(input, ring, vertices);
    if (size.count > 0 && !ShortRing::Holds(size)) {
      unrolled.sizes()[ring] = size;
      return;
    }
    if (size.count > 0) {
      ShortRing memory;
      RefineRing(input, ring, memory.Of(size), vertices);
    }
    Thin(input, ring, vertices);
  });
  unrolled.Allocate();
  ParallelFor(topology.RingCount(), [&](std::size_t ring) {
    if (unrolled.sizes()[ring].count == 0) return;
    RefineRing(input, ring, unrolled[ring], vertices);
    Thin(input, ring, vertices);
  });
}

}  // namespace partiemc
