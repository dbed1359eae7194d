#include "measure.h"

#include <cmath>

namespace partiemc {

RingMeasures MeasureRing(std::span<const double> points) {
  RingMeasures measures;
  const double x0 = points[0];
  const double y0 = points[1];
  const std::size_t count = points.size() / 2;
  double twice_area = 0, moment_x = 0, moment_y = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t next = k + 1 < count ? k + 1 : 0;
    const double ax = points[2 * k] - x0, ay = points[2 * k + 1] - y0;
    const double bx = points[2 * next] - x0, by = points[2 * next + 1] - y0;
    const double cross = ax * by - bx * ay;
    twice_area += cross;
    moment_x += (ax + bx) * cross;
    moment_y += (ay + by) * cross;
    measures.perimeter += std::sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay));
  }
  measures.area = twice_area / 2;
  const bool flat = twice_area == 0;
  measures.centroid_x = x0 + (flat ? 0 : moment_x / (3 * twice_area));
  measures.centroid_y = y0 + (flat ? 0 : moment_y / (3 * twice_area));
  return measures;
}

}  // namespace partiemc
