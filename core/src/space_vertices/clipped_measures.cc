#include "space_vertices/clipped_measures.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace partiemc::space {
namespace {

/// A triangle clipped at the six sides of a box. Each side adds at most one corner.
struct Polygon {
  std::array<Vec3, 9> corners;
  std::size_t count = 0;

  void Add(const Vec3& corner) { corners[count++] = corner; }
};

/// The part of a convex polygon with sign * (coordinate - at) >= 0.
template <typename Coordinate>
Polygon Clipped(const Polygon& from, Coordinate of, double at, double sign) {
  Polygon part;
  for (std::size_t k = 0; k < from.count; ++k) {
    const Vec3& a = from.corners[k];
    const Vec3& b = from.corners[k + 1 == from.count ? 0 : k + 1];
    const double from_a = sign * (of(a) - at), from_b = sign * (of(b) - at);
    if (from_a >= 0) part.Add(a);
    if ((from_a >= 0) != (from_b >= 0)) part.Add(a + (from_a / (from_a - from_b)) * (b - a));
  }
  return part;
}

/// Adds the flux of (clamp(x, low, high), 0, 0) through a polygon that crosses neither limit.
void AddFlux(const Polygon& polygon, double low, double high, ClippedMeasure& sum) {
  const auto x = [&](const Vec3& at) { return std::clamp(at.x, low, high); };
  for (std::size_t k = 2; k < polygon.count; ++k) {
    const Vec3 &a = polygon.corners[0], &b = polygon.corners[k - 1], &c = polygon.corners[k];
    const double along_x = (b.y - a.y) * (c.z - a.z) - (b.z - a.z) * (c.y - a.y);
    sum.volume += along_x * (x(a) + x(b) + x(c)) / 6;
  }
}

double AreaOf(const Polygon& polygon) {
  double area = 0;
  for (std::size_t k = 2; k < polygon.count; ++k) {
    area += Length(Cross(polygon.corners[k - 1] - polygon.corners[0],
                         polygon.corners[k] - polygon.corners[0])) /
            2;
  }
  return area;
}

bool IsIn(const Vec3& at, const ClipBox& box) {
  return at.x >= box.low.x && at.x <= box.high.x && at.y >= box.low.y && at.y <= box.high.y &&
         at.z >= box.low.z && at.z <= box.high.z;
}

}  // namespace

ClippedMeasure MeasureClipped(const Vec3& a, const Vec3& b, const Vec3& c, const ClipBox& box) {
  Polygon all;
  for (const Vec3& corner : {a, b, c}) all.Add(corner);
  ClippedMeasure sum;
  if (IsIn(a, box) && IsIn(b, box) && IsIn(c, box)) {
    AddFlux(all, box.low.x, box.high.x, sum);
    sum.area = AreaOf(all);
    return sum;
  }
  const auto x = [](const Vec3& at) { return at.x; };
  const auto y = [](const Vec3& at) { return at.y; };
  const auto z = [](const Vec3& at) { return at.z; };
  all = Clipped(Clipped(all, y, box.low.y, 1), y, box.high.y, -1);
  all = Clipped(Clipped(all, z, box.low.z, 1), z, box.high.z, -1);
  const Polygon above = Clipped(all, x, box.low.x, 1);
  const Polygon within = Clipped(above, x, box.high.x, -1);
  AddFlux(Clipped(all, x, box.low.x, -1), box.low.x, box.high.x, sum);
  AddFlux(within, box.low.x, box.high.x, sum);
  AddFlux(Clipped(above, x, box.high.x, 1), box.low.x, box.high.x, sum);
  sum.area = AreaOf(within);
  return sum;
}

}  // namespace partiemc::space
