#include "gauges/fits.h"

#include <cmath>
#include <cstddef>

namespace partiemc {
namespace {

Point MeanOf(std::span<const Point> points) {
  Point mean;
  for (const Point& p : points) {
    mean.x += p.x;
    mean.y += p.y;
  }
  const auto count = static_cast<double>(points.size());
  return {mean.x / count, mean.y / count};
}

}  // namespace

std::optional<Circle> FitCircle(std::span<const Point> points) {
  if (points.size() < 4) return std::nullopt;
  const Point mean = MeanOf(points);
  double xx = 0, xy = 0, yy = 0, xz = 0, yz = 0, zz = 0;
  for (const Point& p : points) {
    const double x = p.x - mean.x, y = p.y - mean.y, z = x * x + y * y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
    xz += x * z;
    yz += y * z;
    zz += z * z;
  }
  const auto count = static_cast<double>(points.size());
  for (double* const moment : {&xx, &xy, &yy, &xz, &yz, &zz}) *moment /= count;
  // The smallest root of the characteristic polynomial. Newton's iteration reaches it from 0.
  const double z = xx + yy, covariance = xx * yy - xy * xy, variance = zz - z * z;
  const double a3 = 4 * z, a2 = -3 * z * z - zz;
  const double a1 = variance * z + 4 * covariance * z - xz * xz - yz * yz;
  const double a0 = xz * (xz * yy - yz * xy) + yz * (yz * xx - xz * xy) - variance * covariance;
  constexpr int kMostSteps = 50;
  double root = 0, value = a0;
  for (int step = 0; step < kMostSteps; ++step) {
    const double slope = a1 + root * (2 * a2 + 3 * a3 * root);
    const double next = root - value / slope;
    if (next == root || !std::isfinite(next)) break;
    const double next_value = a0 + next * (a1 + next * (a2 + next * a3));
    if (std::abs(next_value) >= std::abs(value)) break;
    root = next;
    value = next_value;
  }
  const double determinant = root * root - root * z + covariance;
  const double x = (xz * (yy - root) - yz * xy) / determinant / 2;
  const double y = (yz * (xx - root) - xz * xy) / determinant / 2;
  const double radius = std::sqrt(x * x + y * y + z);
  if (!std::isfinite(radius)) return std::nullopt;
  return Circle{{mean.x + x, mean.y + y}, radius};
}

std::optional<double> FitSlope(std::span<const Point> points) {
  if (points.size() < 2) return std::nullopt;
  const Point mean = MeanOf(points);
  double xx = 0, xy = 0;
  for (const Point& p : points) {
    xx += (p.x - mean.x) * (p.x - mean.x);
    xy += (p.x - mean.x) * (p.y - mean.y);
  }
  if (xx == 0) return std::nullopt;
  return xy / xx;
}

}  // namespace partiemc
