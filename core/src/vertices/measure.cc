#include "vertices/measure.h"

#include <cmath>
#include <cstddef>

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

void MeasureRings(Rings& rings) {
  rings.measures.resize(rings.RingCount());
  ParallelFor(rings.RingCount(), [&](std::size_t ring) {
    rings.measures[ring] = MeasureRing(rings.RingPoints(ring));
  });
}

}  // namespace partiemc
