// A point or vector of space, in any unit.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace partiemc {

struct Vec3 {
  double x = 0, y = 0, z = 0;

  friend constexpr Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend constexpr Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend constexpr Vec3 operator*(double factor, const Vec3& a) {
    return {factor * a.x, factor * a.y, factor * a.z};
  }
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

constexpr double Dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

constexpr Vec3 Cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The lower, and the higher, of each coordinate.
constexpr Vec3 Lower(const Vec3& a, const Vec3& b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
constexpr Vec3 Upper(const Vec3& a, const Vec3& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

inline double Length(const Vec3& a) { return std::sqrt(Dot(a, a)); }

/// The vector of length 1 in the direction of `a`, or 0 if `a` is 0.
inline Vec3 Normalised(const Vec3& a) {
  const double length = Length(a);
  return length > 0 ? (1 / length) * a : Vec3{};
}

/// The point at `index` of interleaved coordinates x, y, z.
inline Vec3 Vec3At(std::span<const double> points, std::size_t index) {
  return {points[3 * index], points[3 * index + 1], points[3 * index + 2]};
}

}  // namespace partiemc
