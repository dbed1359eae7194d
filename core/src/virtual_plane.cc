#include "virtual_plane.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "placement.h"

namespace partiemc {
namespace {

// Longest Newton step of an edge crossing, in cells: it stays nearer to its edge than to the
// vertices of the cells beside it.
constexpr double kMaxEdgeStep = 0.3;

// Shorter rings stay at their roots: the windows below would meet their own ends.
// Where drops form and vanish, refining short ones costs more calm than it gains shape.
constexpr double kMinRefinedLength = 24;  // Spacings.
constexpr std::size_t kMinRefinedVertices = 24;

// Reaches of the windows along a ring, in spacings. Each was the best of a coarse scan on the
// tuning set; a factor of 1.5 either way changes no ratio by more than a few percent.
constexpr double kNormalReach = 2.5;
constexpr double kBilateralReach = 6;
constexpr double kCurvatureReach = 2;
constexpr double kSmoothingReach = 3;

// The kernel rounds a boundary of curvature kappa off by about half of h^2 kappa, and fills it by
// more where it is concave: in a notch the particles of both flanks count.
constexpr double kRoundingPerConvexCurvature = 0.5;
constexpr double kRoundingPerConcaveCurvature = 0.8;
// Tighter bends than this are noise: no kernel resolves them. In 1 / spacings.
constexpr double kMaxCurvature = 0.6;

// Particles that support a plane, in spacings: in a disc around the vertex, near it along the
// plane, not beyond the plane, and with a weight that falls from the plane to twice the spacing
// below it.
constexpr double kSupportRadius = 2.5;
constexpr double kSupportHalfWidth = 2;
constexpr double kSupportHeight = 1.2;
constexpr double kSupportDepth = 2;
constexpr double kMaxSupportShift = 0.8;
// A plane's own estimate is noisy: this share of it is believed.
constexpr double kSupportTrust = 0.6;

// Edge vertices nearer than this to the chord of their neighbours say nothing, in spacings.
constexpr double kThinningDistance = 0.02;

double Power8(double x) {
  const double x2 = x * x;
  const double x4 = x2 * x2;
  return x4 * x4;
}

double Dot(const LatticePoint& a, const LatticePoint& b) { return a.x * b.x + a.y * b.y; }

// (1 - (d / reach)^2)^2, 0 beyond the reach.
double Window(double distance, double reach) {
  const double t = 1 - distance * distance / (reach * reach);
  return t > 0 ? t * t : 0;
}

// Falls from 1 to 0.1 at 30 degrees: what lies beyond a corner has no say.
double AngleWeight(const LatticePoint& a, const LatticePoint& b) {
  const double cosine = Dot(a, b);
  if (cosine <= 0) return 0;
  const double power = Power8(cosine);
  return power * power;
}

LatticePoint UnitOr(const LatticePoint& v, const LatticePoint& fallback) {
  const double square = Dot(v, v);
  if (square < kWeakGradientSquare * kWeakGradientSquare) return fallback;
  const double length = std::sqrt(square);
  return {v.x / length, v.y / length};
}

const ActiveCell& CellOf(const VertexInput& input, std::size_t segment) {
  const std::uint32_t index = input.topology.segments[segment];
  return input.crossings.cells[input.crossings.segments[index].cell];
}

// A point by the tile that it lies in; tile kNoTile where no particle is near.
struct TilePoint {
  std::uint32_t tile;
  double x, y;
};

TilePoint Locate(const VertexInput& input, std::size_t segment, const LatticePoint& point) {
  const ActiveCell& cell = CellOf(input, segment);
  const LatticePoint origin = CellOrigin(input.bins.tiles, cell);
  const double x = point.x - origin.x + cell.i;
  const double y = point.y - origin.y + cell.j;
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const TilePlace place = Normalise(input.bins.tiles, cell.tile, i, j);
  const bool usable = place.tile != kNoTile && input.field.IsIndexed(place.tile);
  return {usable ? place.tile : kNoTile, place.i + (x - i), place.j + (y - j)};
}

// Step 1: both vertices of a segment on the level set, by one Newton step each, and their normals.
void FindRoots(const VertexInput& input, std::size_t segment, RingVertices& v) {
  const CellPlane& plane = input.planes[segment];
  const std::size_t edge = 2 * segment;
  const std::size_t inner = edge + 1;
  v.root[edge] = v.point[edge] = plane.entry;
  const TilePoint at = Locate(input, segment, plane.entry);
  if (at.tile != kNoTile) {
    const FieldSample sample = input.field.Sample(at.tile, at.x, at.y);
    v.point[edge] = NewtonStep(plane.entry, sample, kMaxEdgeStep);
  }
  v.root[inner] = v.point[inner] =
      ClampToCell(input.bins.tiles, input.crossings, input.topology.segments[segment],
                  VirtualPlaneVertex(plane));
  const LatticePoint outward = UnitOr({plane.OutwardX(), plane.OutwardY()}, {1, 0});
  for (const std::size_t i : {edge, inner}) {
    const TilePoint p = Locate(input, segment, v.point[i]);
    v.normal[i] = outward;
    if (p.tile == kNoTile) continue;
    const FieldSample sample = input.field.Sample(p.tile, p.x, p.y);
    const LatticePoint gradient{sample.gradient_x, sample.gradient_y};
    if (Dot(gradient, gradient) >= kWeakGradientSquare) v.normal[i] = UnitOr(gradient, outward);
  }
}

// Step 2: normals averaged along the ring, first by distance, then also by angle.
void SmoothNormals(const VertexInput& input, const RingView& ring, RingVertices& v) {
  for (const bool bilateral : {false, true}) {
    const double reach = (bilateral ? kBilateralReach : kNormalReach) * input.scale.spacing;
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const LatticePoint normal = v.normal[ring.index(k)];
      LatticePoint sum;
      ring.ForEachNear(k, reach, [&](std::size_t j, double distance) {
        double w = v.weight[j] * Window(distance, reach);
        if (bilateral) w *= AngleWeight(normal, v.normal[j]);
        sum.x += w * v.normal[j].x;
        sum.y += w * v.normal[j].y;
      });
      v.next_normal[ring.index(k)] = UnitOr(sum, normal);
    }
    for (std::size_t k = 0; k < ring.size(); ++k) {
      v.normal[ring.index(k)] = v.next_normal[ring.index(k)];
    }
  }
}

// Curvature of the ring at a vertex: how normals turn along the tangent; positive where convex.
double CurvatureAt(const RingView& ring, const RingVertices& v, std::size_t k, double spacing) {
  const std::size_t i = ring.index(k);
  const LatticePoint tangent{-v.normal[i].y, v.normal[i].x};
  const double reach = kCurvatureReach * spacing;
  double turn = 0, square = 0;
  ring.ForEachNear(k, reach, [&](std::size_t j, double distance) {
    const double w = v.weight[j] * Window(distance, reach);
    const double along = Dot({v.point[j].x - v.point[i].x, v.point[j].y - v.point[i].y}, tangent);
    turn +=
        w * along * Dot({v.normal[j].x - v.normal[i].x, v.normal[j].y - v.normal[i].y}, tangent);
    square += w * along * along;
  });
  const double max_curvature = kMaxCurvature / spacing;
  return square > 0 ? std::clamp(turn / square, -max_curvature, max_curvature) : 0;
}

// How far outside the vertex the particles near its plane put the boundary: their weighted mean
// distance to the parabola of the given curvature, plus half a spacing. 0 without particles.
double SupportAt(const VertexInput& input, const RingVertices& v, std::size_t i, double curvature) {
  const double h = input.scale.spacing;
  const TilePoint p = Locate(input, i / 2, v.point[i]);
  if (p.tile == kNoTile) return 0;
  const LatticePoint normal = v.normal[i];
  const double radius = std::min(kSupportRadius * h, input.scale.kernel_radius);
  double sum = 0, weight = 0;
  input.field.ForEachNear(p.tile, p.x, p.y, radius, [&](double x, double y, std::uint32_t) {
    const LatticePoint d{x - p.x, y - p.y};
    const double along = normal.x * d.y - normal.y * d.x;
    const double above = Dot(d, normal);
    if (Dot(d, d) >= radius * radius || above >= kSupportHeight * h) return;
    const double distance = above + curvature * along * along / 2;
    const double depth = distance / h + kSupportDepth;
    if (depth <= 0) return;
    const double w = Window(along, kSupportHalfWidth * h) * Power8(depth);
    sum += w * distance;
    weight += w;
  });
  if (weight <= 0) return 0;
  return std::clamp(sum / weight + h / 2, -kMaxSupportShift * h, kMaxSupportShift * h);
}

// How far the kernel has moved a boundary of this curvature inward.
double RoundingOf(double curvature, double spacing) {
  const double share = curvature > 0 ? kRoundingPerConvexCurvature : kRoundingPerConcaveCurvature;
  return share * spacing * spacing * curvature;
}

// Step 3: how far each vertex's plane moves along its normal. Of the support only the variation
// along the ring counts: its mean depends on how the particles are arranged, not on the shape.
void ShiftPlanes(const VertexInput& input, const RingView& ring, RingVertices& v) {
  const double h = input.scale.spacing;
  const VirtualPlaneSteps& steps = input.parameters.steps;
  double sum = 0, weight = 0;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::size_t i = ring.index(k);
    const double curvature = CurvatureAt(ring, v, k, h);
    v.base[i] = steps.curvature ? RoundingOf(curvature, h) : 0;
    v.shift[i] = steps.support ? SupportAt(input, v, i, curvature) - v.base[i] : 0;
    sum += v.weight[i] * v.shift[i];
    weight += v.weight[i];
  }
  const double mean = weight > 0 ? sum / weight : 0;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::size_t i = ring.index(k);
    v.base[i] += kSupportTrust * (v.shift[i] - mean);
  }
}

// Step 4: every vertex to the weighted mean of what its neighbours' planes say, along its normal.
// A circle stays as it is: of two points of it, the mean normal is perpendicular to their chord.
void SmoothPositions(const VertexInput& input, const RingView& ring, RingVertices& v) {
  const double reach = kSmoothingReach * input.scale.spacing;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::size_t i = ring.index(k);
    v.shift[i] = v.base[i];
    if (!input.parameters.steps.smoothing) continue;
    double sum = 0, weight = 0;
    ring.ForEachNear(k, reach, [&](std::size_t j, double distance) {
      const double w =
          v.weight[j] * Window(distance, reach) * AngleWeight(v.normal[i], v.normal[j]);
      const LatticePoint chord{v.point[j].x - v.point[i].x, v.point[j].y - v.point[i].y};
      const double offset = (Dot(v.normal[i], chord) + Dot(v.normal[j], chord)) / 2;
      sum += w * (offset + v.base[j] - v.base[i]);
      weight += w;
    });
    if (weight > 0) v.shift[i] += sum / weight;
  }
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::size_t i = ring.index(k);
    v.point[i].x += v.shift[i] * v.normal[i].x;
    v.point[i].y += v.shift[i] * v.normal[i].y;
  }
}

// Step 5: drops edge vertices that lie on the chord of the cell vertices beside them.
void Thin(const VertexInput& input, const RingView& ring, RingVertices& v) {
  const double min_distance = kThinningDistance * input.scale.spacing;
  for (std::size_t k = 0; k < ring.size(); k += 2) {
    const LatticePoint& a = v.point[ring.index(k == 0 ? ring.size() - 1 : k - 1)];
    const LatticePoint& p = v.point[ring.index(k)];
    const LatticePoint& b = v.point[ring.index(k + 1)];
    const LatticePoint chord{b.x - a.x, b.y - a.y};
    const double cross = chord.x * (p.y - a.y) - chord.y * (p.x - a.x);
    v.is_kept[ring.index(k)] = input.parameters.steps.edge_vertices &&
                               std::abs(cross) >= min_distance * std::sqrt(Dot(chord, chord));
  }
}

}  // namespace

double RingView::Measure() const {
  double length = 0;
  for (std::size_t k = 0; k < count_; ++k) {
    const LatticePoint& a = vertices_.point[first_ + k];
    const LatticePoint& b = vertices_.point[first_ + (k + 1 == count_ ? 0 : k + 1)];
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    vertices_.step[first_ + k] = std::sqrt(dx * dx + dy * dy);
    length += vertices_.step[first_ + k];
  }
  for (std::size_t k = 0; k < count_; ++k) {
    const std::size_t before = k == 0 ? count_ - 1 : k - 1;
    vertices_.weight[first_ + k] =
        (vertices_.step[first_ + before] + vertices_.step[first_ + k]) / 2;
  }
  return length;
}

void RingVertices::Resize(std::size_t count) {
  point.resize(count);
  root.resize(count);
  normal.resize(count);
  step.resize(count);
  weight.resize(count);
  base.resize(count);
  shift.resize(count);
  next_normal.resize(count);
  is_kept.assign(count, 1);
}

void PlaceOnVirtualPlanes(const VertexInput& input, RingVertices& vertices) {
  const std::size_t segments = input.topology.segments.size();
  vertices.Resize(2 * segments);
  tbb::parallel_for(std::size_t{0}, segments,
                    [&](std::size_t segment) { FindRoots(input, segment, vertices); });
  tbb::parallel_for(std::size_t{0}, input.topology.RingCount(), [&](std::size_t r) {
    const std::size_t first = input.topology.offsets[r];
    const RingView ring(vertices, 2 * first, 2 * (input.topology.offsets[r + 1] - first));
    const double length = ring.Measure();
    if (ring.size() >= kMinRefinedVertices && length >= kMinRefinedLength * input.scale.spacing) {
      if (input.parameters.steps.normals) SmoothNormals(input, ring, vertices);
      ShiftPlanes(input, ring, vertices);
      SmoothPositions(input, ring, vertices);
    }
    Thin(input, ring, vertices);
  });
}

}  // namespace partiemc
