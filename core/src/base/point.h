// A point of the plane, in whatever unit the caller works in.
#pragma once

#include <cstddef>
#include <span>

namespace partiemc {

struct Point {
  double x = 0, y = 0;

  friend bool operator==(const Point&, const Point&) = default;
};

/// The order in which sweeps meet points: by y, points of equal y by x. It is the order along a
/// direction that leans from the y axis towards x by less than any angle in the input, so that no
/// two distinct points are met at once.
constexpr bool SweepsBefore(const Point& a, const Point& b) {
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}

/// Of interleaved points.
inline Point PointAt(std::span<const double> points, std::size_t index) {
  return {points[2 * index], points[2 * index + 1]};
}

}  // namespace partiemc
