#include "simplify/far_points.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>

#include "base/vec3.h"
#include "simplify/mesh_faults.h"

namespace partiemc::simplify {
namespace {

// In units of WorkLimit.
constexpr std::uint64_t kWorkOfPoint = 8;

double SquareToSegment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double t = std::clamp(Dot(p - a, along) / Dot(along, along), 0.0, 1.0);
  const Vec3 from = p - a - t * along;
  return Dot(from, from);
}

/// The squared distance of p from a triangle; from the triangle's sides if it has no area.
double SquareToTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = Cross(b - a, c - a);
  const double square = Dot(normal, normal);
  if (square > 0 && Dot(normal, Cross(b - a, p - a)) >= 0 &&
      Dot(normal, Cross(c - b, p - b)) >= 0 && Dot(normal, Cross(a - c, p - c)) >= 0) {
    const double height = Dot(normal, p - a);
    return height * height / square;
  }
  return std::min({SquareToSegment(p, a, b), SquareToSegment(p, b, c), SquareToSegment(p, c, a)});
}

/// A removed point, and its cell. Sorted, the cells of a row are consecutive.
struct Removed {
  std::int64_t z, y, x;
  std::uint32_t point;
  bool is_near = false;

  friend bool operator<(const Removed& a, const Removed& b) {
    return std::tie(a.z, a.y, a.x, a.point) < std::tie(b.z, b.y, b.x, b.point);
  }
};

}  // namespace

void FindFarPoints(std::span<const double> points, PointRange range,
                   std::span<const std::uint32_t> triangles, double distance, double cell,
                   std::vector<std::uint32_t>& far, WorkLimit* limit) {
  far.clear();
  WorkCounter work(limit);
  std::vector<std::uint8_t> is_kept(range.last - range.first, 0);
  for (const std::uint32_t point : triangles) is_kept[point - range.first] = 1;
  const Vec3 origin = Vec3At(points, range.first);
  const auto removed_at = [&](const Vec3& at, std::uint32_t point) {
    const Vec3 from = (1 / cell) * (at - origin);
    const auto floor = [](double value) { return static_cast<std::int64_t>(std::floor(value)); };
    return Removed{floor(from.z), floor(from.y), floor(from.x), point};
  };
  std::vector<Removed> removed;
  for (std::uint32_t point = range.first; point < range.last; ++point) {
    if (is_kept[point - range.first] == 0) {
      removed.push_back(removed_at(Vec3At(points, point), point));
    }
  }
  std::sort(removed.begin(), removed.end());
  const Vec3 reach{distance, distance, distance};
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Box box = BoxOf(points, triangles.subspan(t, 3));
    const Removed low = removed_at(box.low - reach, 0);
    const Removed high = removed_at(box.high + reach, 0);
    const Vec3 a = Vec3At(points, triangles[t]), b = Vec3At(points, triangles[t + 1]),
               c = Vec3At(points, triangles[t + 2]);
    const auto from = [&](std::int64_t z, std::int64_t y) {
      return std::lower_bound(removed.begin(), removed.end(), Removed{z, y, low.x, 0});
    };
    // Skips rows of cells without points, of which a large box has many.
    auto point = from(low.z, low.y);
    while (point != removed.end() && point->z <= high.z) {
      work.Add(kWorkOfPoint);
      if (point->y < low.y) {
        point = from(point->z, low.y);
      } else if (point->y > high.y) {
        point = from(point->z + 1, low.y);
      } else if (point->x < low.x) {
        point = from(point->z, point->y);
      } else if (point->x > high.x) {
        point = from(point->z, point->y + 1);
      } else {
        if (!point->is_near) {
          point->is_near =
              SquareToTriangle(Vec3At(points, point->point), a, b, c) <= distance * distance;
        }
        ++point;
      }
    }
  }
  work.Finish();
  for (const Removed& point : removed) {
    if (!point.is_near) far.push_back(point.point);
  }
}

}  // namespace partiemc::simplify
