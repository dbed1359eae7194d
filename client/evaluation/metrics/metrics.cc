#include "client/evaluation/metrics/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace partiemc::evaluation {
namespace {

constexpr double kCornerTurn = 0.1;  // Radians.
// What has moved otherwise than the map says by more than this is left out of jitter: well below
// what methods differ by, well above what truths and fits are off by. Spacings.
constexpr double kMotionTolerance = 0.1;

// Width of index cells in spacings: compared curves are a fraction of a spacing apart.
constexpr double kIndexCell = 0.25;

struct Directed {
  double sum = 0, count = 0, largest = 0;

  void Add(double distance) {
    sum += distance;
    ++count;
    largest = std::max(largest, distance);
  }
  double Mean() const { return count > 0 ? sum / count : 0; }
};

template <typename Counts>
Directed DirectedDistance(const CurveSamples& from, const SegmentIndex& to, Counts counts) {
  Directed directed;
  for (const Point& p : from.middles) {
    if (counts(p)) directed.Add(to.Find(p).distance);
  }
  for (const Point& p : from.corners) {
    if (counts(p)) directed.largest = std::max(directed.largest, to.Find(p).distance);
  }
  return directed;
}

// Of the samples of `from` that `trace` can follow to where `to` is, their distances there.
template <typename Trace>
Directed TracedDistance(const Curve& from, const SegmentIndex& to, Trace trace) {
  const double tolerance = kMotionTolerance * from.spacing;
  Directed directed;
  for (const Point& p : from.samples.middles) {
    if (const auto [arrival, off] = trace(p); off <= tolerance) {
      directed.Add(to.Find(arrival).distance);
    }
  }
  for (const Point& p : from.samples.corners) {
    if (const auto [arrival, off] = trace(p); off <= tolerance) {
      directed.largest = std::max(directed.largest, to.Find(arrival).distance);
    }
  }
  return directed;
}

template <typename Counts>
Deviation SymmetricDeviation(const Curve& a, const Curve& b, Counts counts) {
  if (a.index.Empty() || b.index.Empty()) {
    const double extent = std::max(a.index.Extent(), b.index.Extent()) / a.spacing;
    return {extent, extent};
  }
  const Directed there = DirectedDistance(a.samples, b.index, counts);
  const Directed back = DirectedDistance(b.samples, a.index, counts);
  return {std::max(there.largest, back.largest) / a.spacing,
          (there.Mean() + back.Mean()) / 2 / a.spacing};
}

std::size_t Difference(std::size_t a, std::size_t b) { return a > b ? a - b : b - a; }

}  // namespace

CurveSamples SampleCurve(const Outline& curve, double step) {
  const double corner_cosine = 1 - kCornerTurn * kCornerTurn / 2;
  CurveSamples samples;
  for (std::size_t k = 0; k < curve.LoopCount(); ++k) {
    const auto loop = curve.Loop(k);
    double length = 0;
    Point before = loop.front() - loop.back();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point along = loop[(i + 1) % loop.size()] - loop[i];
      const double piece = Length(along);
      if (Dot(before, along) < corner_cosine * Length(before) * piece) {
        samples.corners.push_back(loop[i]);
      }
      length += piece;
      before = along;
    }
    const double pieces = std::max(1.0, std::ceil(length / step));
    double walked = 0;
    double next = 0.5;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point along = loop[(i + 1) % loop.size()] - loop[i];
      const double piece = Length(along);
      for (; next < pieces && next * length / pieces < walked + piece; ++next) {
        samples.middles.push_back(loop[i] + ((next * length / pieces - walked) / piece) * along);
      }
      walked += piece;
    }
  }
  return samples;
}

Curve::Curve(const Outline& outline, double spacing_in)
    : samples(SampleCurve(outline, kSampleStep * spacing_in)),
      index(outline, kIndexCell * spacing_in),
      spacing(spacing_in) {}

Deviation Compare(const Curve& a, const Curve& b) {
  return SymmetricDeviation(a, b, [](Point) { return true; });
}

Deviation Jitter(const Curve& carried, const Curve& next, const SegmentIndex* carried_truth,
                 const SegmentIndex* next_truth) {
  if (carried_truth == nullptr || next_truth == nullptr) return Compare(carried, next);
  return SymmetricDeviation(carried, next, [&](Point p) {
    const double change = carried_truth->Find(p).distance - next_truth->Find(p).distance;
    return std::abs(change) <= kMotionTolerance * carried.spacing;
  });
}

KnownJitter JitterWhereKnown(const Curve& before, const Curve& next, const Advection& advection) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  KnownJitter jitter{{kNone, kNone}, 0};
  if (before.index.Empty() || next.index.Empty()) return jitter;
  const Directed there =
      TracedDistance(before, next.index, [&](Point p) { return advection.Forward(p); });
  const Directed back =
      TracedDistance(next, before.index, [&](Point p) { return advection.Backward(p); });
  jitter.known_share =
      (there.count + back.count) /
      static_cast<double>(before.samples.middles.size() + next.samples.middles.size());
  if (there.count > 0 && back.count > 0) {
    jitter.deviation = {std::max(there.largest, back.largest) / next.spacing,
                        (there.Mean() + back.Mean()) / 2 / next.spacing};
  }
  return jitter;
}

Outline Carried(const Outline& contour, const Motion& motion, std::size_t frame, double spacing) {
  Outline carried = Densify(contour, kSampleStep * spacing);
  motion.Carry(frame, carried.points);
  return carried;
}

Defects FindDefects(const Result& result, const Outline& truth, const SegmentIndex& truth_index,
                    double spacing) {
  Defects defects;
  const Rings& rings = result.rings;
  const SegmentIndex contour(OutlineOf(rings), spacing);
  defects.self_intersections = contour.CountCrossings();
  const auto corner = [&mesh = result.mesh](std::uint32_t point) {
    return Point{mesh.points[2 * point], mesh.points[2 * point + 1]};
  };
  for (std::size_t t = 0; t < result.mesh.TriangleCount(); ++t) {
    const std::uint32_t* triangle = &result.mesh.triangles[3 * t];
    const Point a = corner(triangle[0]);
    if (Cross(corner(triangle[1]) - a, corner(triangle[2]) - a) <= 0) ++defects.folds;
  }
  for (std::size_t k = 0; k < rings.measures.size(); ++k) {
    if (rings.outer_of[k] == kNoRing && rings.measures[k].particle_count == 0) {
      ++defects.spurious_components;
    }
  }
  if (truth.Empty()) return defects;
  const auto outer =
      static_cast<std::size_t>(std::count(rings.outer_of.begin(), rings.outer_of.end(), kNoRing));
  const LoopCounts wanted = CountLoops(truth);
  defects.component_error = Difference(outer, wanted.outer);
  defects.hole_error = Difference(rings.RingCount() - outer, wanted.holes);
  std::size_t wrong = 0;
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    const Point p = {rings.points[2 * k], rings.points[2 * k + 1]};
    const Point expected = truth_index.OutwardNormal(truth_index.Find(p).segment);
    const Point normal = {rings.normals[2 * k], rings.normals[2 * k + 1]};
    if (Dot(normal, expected) < 0) ++wrong;
  }
  if (rings.PointCount() > 0) {
    defects.wrong_normal_share =
        static_cast<double>(wrong) / static_cast<double>(rings.PointCount());
  }
  return defects;
}

}  // namespace partiemc::evaluation
