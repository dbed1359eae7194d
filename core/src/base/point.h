// A point of the plane, in any unit.
#pragma once

#include <cstddef>
#include <span>

namespace partiemc {

struct Point {
  double x = 0, y = 0;

  friend bool operator==(const Point&, const Point&) = default;
};

/// The order in which a sweep visits points: by y, then by x. This equals the order along a
/// direction tilted from y towards x by less than any angle in the input, so the sweep never visits
/// two distinct points at once.
constexpr bool SweepsBefore(const Point& a, const Point& b) {
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}

/// The point at `index` of interleaved coordinates.
inline Point PointAt(std::span<const double> points, std::size_t index) {
  return {points[2 * index], points[2 * index + 1]};
}

}  // namespace partiemc
