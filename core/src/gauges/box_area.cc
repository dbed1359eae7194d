#include "gauges/box_area.h"

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace partiemc {
namespace {

// Keeps the part of a closed polygon where inside(point) >= 0. `inside` is a linear function.
template <typename Inside>
void Clip(const std::vector<Point>& polygon, std::vector<Point>& clipped, const Inside& inside) {
  clipped.clear();
  if (polygon.empty()) return;
  Point a = polygon.back();
  double depth_a = inside(a);
  for (const Point& b : polygon) {
    const double depth_b = inside(b);
    if ((depth_a >= 0) != (depth_b >= 0)) {
      const double fraction = depth_a / (depth_a - depth_b);
      clipped.push_back({a.x + fraction * (b.x - a.x), a.y + fraction * (b.y - a.y)});
    }
    if (depth_b >= 0) clipped.push_back(b);
    a = b;
    depth_a = depth_b;
  }
}

}  // namespace

BoxArea AreaInBox(const Rings& rings, const Point& min, const Point& max) {
  // Coordinates are relative to the middle of the box, so that the sums lose no digits far from the
  // origin.
  const Point middle{min.x + (max.x - min.x) / 2, min.y + (max.y - min.y) / 2};
  double twice_area = 0, moment_x = 0, moment_y = 0;
  double magnitude = 0;  // Sum of the absolute terms of twice_area.
  std::vector<Point> polygon, clipped;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::span<const double> points = rings.RingPoints(ring);
    polygon.clear();
    for (std::size_t k = 0; k < points.size() / 2; ++k) polygon.push_back(PointAt(points, k));
    Clip(polygon, clipped, [&](const Point& p) { return p.x - min.x; });
    Clip(clipped, polygon, [&](const Point& p) { return max.x - p.x; });
    Clip(polygon, clipped, [&](const Point& p) { return p.y - min.y; });
    Clip(clipped, polygon, [&](const Point& p) { return max.y - p.y; });
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Point& from = polygon[k];
      const Point& to = polygon[k + 1 < polygon.size() ? k + 1 : 0];
      const Point a{from.x - middle.x, from.y - middle.y}, b{to.x - middle.x, to.y - middle.y};
      const double cross = a.x * b.y - b.x * a.y;
      twice_area += cross;
      magnitude += std::abs(cross);
      moment_x += (a.x + b.x) * cross;
      moment_y += (a.y + b.y) * cross;
    }
  }
  // If the box lies in a hole, the clipped outer ring and the clipped hole cancel, except for
  // rounding.
  constexpr double kRounding = 1e-14;
  if (std::abs(twice_area) <= kRounding * magnitude) return {.area = 0, .centroid = {NAN, NAN}};
  return {
      .area = twice_area / 2,
      .centroid = {middle.x + moment_x / (3 * twice_area), middle.y + moment_y / (3 * twice_area)}};
}

}  // namespace partiemc
