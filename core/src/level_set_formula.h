// The level set as a function of the kernel's moments at a point (core/METHOD.md).
#pragma once

#include <algorithm>
#include <cmath>

#include "scale.h"

namespace partiemc {

/// Larger eigenvalue of the symmetric matrix (xx xy; xy yy), which has no negative one.
inline double LargerEigenvalue(double xx, double xy, double yy) {
  const double half = (xx - yy) / 2;
  return (xx + yy) / 2 + std::sqrt(half * half + xy * xy);
}

/// F = min(max(phi, (g - f) R / 1.164, (s - s0) R / 0.45), (t - f) R / 1.164), in cells, from
///   the density f;
///   phi = |x - xbar| - r;
///   the spread s, the larger eigenvalue of sum k d d^T / (R^2 sum k), d = x_i - x.
/// Where f is at most g, or above t, the density alone decides the side: phi and s are asked in
/// between only. All branches are lengths. In vectors it is in NodeFormula (tile_kernels.cc) and,
/// with its gradient, PointFormula (point_formula-inl.h).
inline double LevelSetValue(const Scale& scale, double density, double phi, double spread) {
  // Positive where the density is below g.
  const double guard = (scale.guard - density) * scale.guard_slope;
  // Positive between bodies, where particles are on both sides and none is near.
  const double gap = (spread - scale.gap_spread) * scale.gap_slope;
  // Negative where the density is above t.
  const double saturation = (scale.saturation - density) * scale.guard_slope;
  return std::min(std::max({phi, guard, gap}), saturation);
}

}  // namespace partiemc
