#include "vertices/measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/parallel.h"
#include "base/point.h"

namespace partiemc {

RingMeasures MeasureRing(std::span<const double> points) {
  RingMeasures measures;
  const double x0 = points[0];
  const double y0 = points[1];
  const std::size_t count = points.size() / 2;
  double twice_area = 0, moment_x = 0, moment_y = 0;
  Point a;
  for (std::size_t k = 1; k <= count; ++k) {
    const std::size_t next = k < count ? k : 0;
    const Point b{points[2 * next] - x0, points[2 * next + 1] - y0};
    const double cross = a.x * b.y - b.x * a.y;
    const double dx = b.x - a.x, dy = b.y - a.y;
    twice_area += cross;
    moment_x += (a.x + b.x) * cross;
    moment_y += (a.y + b.y) * cross;
    measures.perimeter += std::sqrt(dx * dx + dy * dy);
    a = b;
  }
  measures.area = twice_area / 2;
  const bool flat = twice_area == 0;
  measures.centroid_x = x0 + (flat ? 0 : moment_x / (3 * twice_area));
  measures.centroid_y = y0 + (flat ? 0 : moment_y / (3 * twice_area));
  return measures;
}

WindowMeasures MeasureInWindow(std::span<const double> points, const Window& window,
                               std::span<const float> sizes) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 2> low{-kInfinity, -kInfinity}, high{kInfinity, kInfinity};
  for (std::size_t k = 0; k < 2; ++k) {
    if (!window.axes[k]) continue;
    low[k] = window.axes[k]->origin;
    high[k] = low[k] + window.axes[k]->length;
  }
  // The area is the integral of y dx over the ring, each of whose points moves to the nearest point
  // of the window. The lines of the window's sides cut a segment into pieces, which stay straight.
  WindowMeasures measures;
  const std::size_t count = points.size() / 2;
  const double base = std::clamp(points[1], low[1], high[1]);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t next = k + 1 < count ? k + 1 : 0;
    const double size = sizes.empty() ? 1 : (double{sizes[k]} + sizes[next]) / 2;
    const Point a = PointAt(points, k), b = PointAt(points, next);
    const double dx = b.x - a.x, dy = b.y - a.y;
    std::array<double, 6> at{0, 1, 1, 1, 1, 1};  // Ends of pieces; the unused ones are 1.
    std::size_t pieces = 1;
    const auto split = [&](double from, double step, double line) {
      const double t = (line - from) / step;
      if (t > 0 && t < 1) at[pieces++] = t;
    };
    for (const double line : {low[0], high[0]}) split(a.x, dx, line);
    for (const double line : {low[1], high[1]}) split(a.y, dy, line);
    std::ranges::sort(at);
    const auto clamped = [&](double t) {
      return Point{std::clamp(a.x + t * dx, low[0], high[0]),
                   std::clamp(a.y + t * dy, low[1], high[1])};
    };
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      const Point from = clamped(at[piece]), to = clamped(at[piece + 1]);
      measures.area -= (to.x - from.x) * ((from.y + to.y) / 2 - base);
      const double middle = (at[piece] + at[piece + 1]) / 2;
      const double x = a.x + middle * dx, y = a.y + middle * dy;
      if (x <= low[0] || x >= high[0] || y <= low[1] || y >= high[1]) continue;
      const double length = at[piece + 1] - at[piece];
      measures.perimeter += size * length * std::sqrt(dx * dx + dy * dy);
    }
  }
  return measures;
}

void MeasureRings(Rings& rings) {
  rings.measures.resize(rings.RingCount());
  ParallelFor(rings.RingCount(), [&](std::size_t ring) {
    rings.measures[ring] = MeasureRing(rings.RingPoints(ring));
  });
}

}  // namespace partiemc
