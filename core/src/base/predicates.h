// Exact geometric predicates: a floating-point filter decides almost every call; exact expansion
// arithmetic decides the others.
//
// Source: J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
// Predicates", Discrete & Computational Geometry 18 (1997).
//
// Domain: coordinates that are zero or of a magnitude in [kMinMagnitude, kMaxMagnitude]. In the
// domain no product of two coordinates overflows or loses subnormal bits, so every error-free
// transformation is exact. Outside the domain a sign may be wrong; nothing else happens.
// Requires round-to-nearest and no contraction of a * b + c (-ffp-contract=off).
#pragma once

#include "base/point.h"

namespace partiemc {

/// In the domain, coordinates and their differences are multiples of 2^-451, the last bit of
/// kMinMagnitude. Products of two differences are multiples of 2^-902, far above the smallest
/// normal number, 2^-1022.
inline constexpr double kMinMagnitude = 1e-120;
/// Six products of two coordinates, and a coordinate times 2^27 + 1, stay below 2^1023.
inline constexpr double kMaxMagnitude = 1e150;

/// Whether `coordinate` is in the domain. False for NaN and infinities.
constexpr bool InPredicateDomain(double coordinate) {
  const double magnitude = coordinate < 0 ? -coordinate : coordinate;
  return magnitude == 0 || (magnitude >= kMinMagnitude && magnitude <= kMaxMagnitude);
}

/// Orientation without the filter, for the calls that the filter cannot decide.
int OrientationExact(const Point& a, const Point& b, const Point& c);

/// Returns +1 if a, b, c turn counter-clockwise (c is left of the line from a to b), -1 if
/// clockwise, 0 if they are collinear or two coincide. Exact in the domain above.
/// Cost: 3 ns if the filter decides, 10 ns for collinear lattice points, always below 1 us.
inline int Orientation(const Point& a, const Point& b, const Point& c) {
  // Shewchuk's bound on the error of `determinant` relative to `magnitude`: (3 + 16 eps) eps with
  // eps = 2^-53.
  constexpr double kEpsilon = 0x1p-53;
  constexpr double kErrorBound = (3.0 + 16.0 * kEpsilon) * kEpsilon;

  const double left = (a.x - c.x) * (b.y - c.y);
  const double right = (a.y - c.y) * (b.x - c.x);
  const double determinant = left - right;
  const double magnitude = (left < 0 ? -left : left) + (right < 0 ? -right : right);
  const double bound = kErrorBound * magnitude;
  if (determinant > bound) return 1;
  if (-determinant > bound) return -1;
  // In the domain, a difference or product rounds to zero only if its exact value is zero.
  if (magnitude == 0) return 0;
  return OrientationExact(a, b, c);
}

/// Whether the closed segments ab and cd intersect. Exact in the domain above. A segment of length
/// zero is a point.
bool SegmentsTouch(const Point& a, const Point& b, const Point& c, const Point& d);

}  // namespace partiemc
