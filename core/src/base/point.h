// A point or vector of the plane, in any unit.
#pragma once

#include <cmath>
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

inline Point Plus(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y}; }
inline Point Minus(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y}; }
inline Point Times(const Point& a, double factor) { return {a.x * factor, a.y * factor}; }
inline double Dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y; }
inline double Cross(const Point& a, const Point& b) { return a.x * b.y - a.y * b.x; }
inline double Length(const Point& a) { return std::sqrt(Dot(a, a)); }

/// The angle between two vectors, in radians, in [0, pi]; 0 if one of them is 0. Error below 1e-13.
/// Without libm, whose last bits differ between its versions and processors. Requires: products of
/// the coordinates stay finite.
inline double AngleBetween(const Point& a, const Point& b) {
  const double sine = std::abs(Cross(a, b)), cosine = Dot(a, b);
  const double length = std::sqrt(sine * sine + cosine * cosine);
  if (!(length > 0)) return 0;
  // The tangent of a half of the angle; of a quarter if the angle is obtuse.
  int shares = 2;
  double tangent = sine / (length + cosine);
  if (cosine < 0) {
    const double half_sine = std::sqrt((length - cosine) / (2 * length));
    tangent = half_sine / (1 + sine / (2 * length * half_sine));
    shares = 4;
  }
  for (; shares < 16; shares *= 2) tangent /= 1 + std::sqrt(1 + tangent * tangent);
  // The series of the arc tangent; the tangent is at most .2.
  const double square = tangent * tangent;
  double series = 0;
  for (int power = 17; power > 0; power -= 2) series = 1.0 / power - square * series;
  return shares * tangent * series;
}

}  // namespace partiemc
