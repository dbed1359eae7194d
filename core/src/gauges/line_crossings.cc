#include "gauges/line_crossings.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace partiemc {

std::vector<double> LineCrossings(const Rings& rings, const Point& origin, const Point& direction) {
  const double squared = direction.x * direction.x + direction.y * direction.y;
  const auto side = [&](const Point& p) {
    return direction.x * (p.y - origin.y) - direction.y * (p.x - origin.x);
  };
  const auto along = [&](const Point& p) {
    return (direction.x * (p.x - origin.x) + direction.y * (p.y - origin.y)) / squared;
  };
  std::vector<double> crossings;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::span<const double> points = rings.RingPoints(ring);
    Point a = PointAt(points, points.size() / 2 - 1);
    double side_a = side(a);
    for (std::size_t k = 0; k < points.size() / 2; ++k) {
      const Point b = PointAt(points, k);
      const double side_b = side(b);
      if ((side_a >= 0) != (side_b >= 0)) {
        const double fraction = side_a / (side_a - side_b);
        crossings.push_back(along(a) + fraction * (along(b) - along(a)));
      }
      a = b;
      side_a = side_b;
    }
  }
  std::ranges::sort(crossings);
  return crossings;
}

}  // namespace partiemc
