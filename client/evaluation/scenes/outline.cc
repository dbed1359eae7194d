#include "client/evaluation/scenes/outline.h"

#include <algorithm>
#include <cmath>

namespace partiemc::evaluation {

double Length(Point a) { return std::sqrt(Dot(a, a)); }

void Outline::AddLoop(std::span<const Point> loop) {
  points.insert(points.end(), loop.begin(), loop.end());
  offsets.push_back(static_cast<std::uint32_t>(points.size()));
}

Outline OutlineOf(const Rings& rings) {
  Outline outline;
  outline.points.reserve(rings.PointCount());
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    outline.points.push_back({rings.points[2 * k], rings.points[2 * k + 1]});
  }
  outline.offsets = rings.offsets;
  return outline;
}

double SignedArea(std::span<const Point> loop) {
  double twice = 0;
  for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
    twice += Cross(loop[k] - loop[0], loop[k + 1] - loop[0]);
  }
  return twice / 2;
}

double SignedArea(const Outline& outline) {
  double area = 0;
  for (std::size_t k = 0; k < outline.LoopCount(); ++k) area += SignedArea(outline.Loop(k));
  return area;
}

double Perimeter(const Outline& outline) {
  double perimeter = 0;
  for (std::size_t k = 0; k < outline.LoopCount(); ++k) {
    const auto loop = outline.Loop(k);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      perimeter += Length(loop[(i + 1) % loop.size()] - loop[i]);
    }
  }
  return perimeter;
}

LoopCounts CountLoops(const Outline& outline) {
  LoopCounts counts;
  for (std::size_t k = 0; k < outline.LoopCount(); ++k) {
    ++(SignedArea(outline.Loop(k)) > 0 ? counts.outer : counts.holes);
  }
  return counts;
}

Outline Densify(const Outline& outline, double step) {
  Outline dense;
  for (std::size_t k = 0; k < outline.LoopCount(); ++k) {
    const auto loop = outline.Loop(k);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point a = loop[i];
      const Point along = loop[(i + 1) % loop.size()] - a;
      const double pieces = std::max(1.0, std::ceil(Length(along) / step));
      for (double piece = 0; piece < pieces; ++piece) {
        dense.points.push_back(a + (piece / pieces) * along);
      }
    }
    dense.offsets.push_back(static_cast<std::uint32_t>(dense.points.size()));
  }
  return dense;
}

Point Similarity::Inverse(Point p) const {
  const Point q = (1 / scale) * (p - shift);
  return {cosine * q.x + sine * q.y, cosine * q.y - sine * q.x};
}

}  // namespace partiemc::evaluation
