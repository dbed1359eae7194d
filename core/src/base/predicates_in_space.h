// Exact geometric predicates in space: a floating-point filter decides almost every call; exact
// expansion arithmetic (predicates.h) decides the others.
//
// Domain: coordinates that are zero or of a magnitude in [kMinSpaceMagnitude, kMaxSpaceMagnitude].
// In the domain no product of three coordinates overflows or loses subnormal bits.
#pragma once

#include <cstdint>

#include "base/vec3.h"

namespace partiemc {

/// Differences of coordinates are multiples of 2^-53 kMinSpaceMagnitude, so products of three are
/// multiples of 1e-288.
inline constexpr double kMinSpaceMagnitude = 1e-80;
/// 24 products of three coordinates, and a product times 2^27 + 1, stay below 2^1023.
inline constexpr double kMaxSpaceMagnitude = 1e95;

/// Whether `coordinate` is in the domain. False for NaN and infinities.
constexpr bool InSpaceDomain(double coordinate) {
  const double magnitude = coordinate < 0 ? -coordinate : coordinate;
  return magnitude == 0 || (magnitude >= kMinSpaceMagnitude && magnitude <= kMaxSpaceMagnitude);
}

/// SideOfPlane without the filter, for the calls that the filter cannot decide.
int SideOfPlaneExact(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Number of calls of SideOfPlaneExact by this thread so far. The calls take most of the time if
/// triangles lie in nearly one plane.
std::uint64_t ExactPredicates();

/// The sign of (b - a) x (c - a) . (d - a): +1 if d is on the side of the plane from which a, b, c
/// appear counter-clockwise, -1 on the other side, 0 on the plane or if a, b, c are collinear.
/// Exact in the domain above. Cost: about 5 ns if the filter decides, else up to 2 us.
inline int SideOfPlane(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  // Shewchuk's bound for orient3d: (7 + 56 eps) eps with eps = 2^-53.
  constexpr double kEpsilon = 0x1p-53;
  constexpr double kErrorBound = (7.0 + 56.0 * kEpsilon) * kEpsilon;
  const Vec3 p = a - d, q = b - d, r = c - d;
  const double qr = q.x * r.y, rq = r.x * q.y;
  const double rp = r.x * p.y, pr = p.x * r.y;
  const double pq = p.x * q.y, qp = q.x * p.y;
  const double determinant = p.z * (qr - rq) + q.z * (rp - pr) + r.z * (pq - qp);
  const double magnitude = (std::abs(qr) + std::abs(rq)) * std::abs(p.z) +
                           (std::abs(rp) + std::abs(pr)) * std::abs(q.z) +
                           (std::abs(pq) + std::abs(qp)) * std::abs(r.z);
  const double bound = kErrorBound * magnitude;
  if (determinant > bound) return -1;
  if (-determinant > bound) return 1;
  if (magnitude == 0) return 0;
  return SideOfPlaneExact(a, b, c, d);
}

}  // namespace partiemc
