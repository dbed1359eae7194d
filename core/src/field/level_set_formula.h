// The level set as a function of the kernel's moments at a point (core/METHOD.md).
#pragma once

#include <algorithm>
#include <cmath>

#include "frame/scale.h"

namespace partiemc {

/// Larger eigenvalue of the symmetric matrix (xx xy; xy yy), which has no negative one.
inline double LargerEigenvalue(double xx, double xy, double yy) {
  const double half = (xx - yy) / 2;
  return (xx + yy) / 2 + std::sqrt(half * half + xy * xy);
}

/// F = min(max(phi, (f_0 - f) R / 1.164, (sigma - sigma_0) R / 0.45), (f_1 - f) R / 1.164), in
/// cells, from
///   the density f;
///   phi = |x - xbar| - r_0;
///   the spread sigma, the larger eigenvalue of sum k D D^T / (R^2 sum k), D = x_i - x.
/// Where f is at most f_0, or above f_1, the density alone decides the side: phi and sigma are
/// needed in between only. All branches are lengths. In vectors it is in NodeFormula
/// (tile_kernels.cc) and, with its gradient, PointFormula (point_formula-inl.h).
inline double LevelSetValue(const Scale& scale, double density, double phi, double spread) {
  // Positive where the density is below f_0.
  const double guard = (scale.guard - density) * scale.guard_slope;
  // Positive between bodies, where particles are on both sides and none is near.
  const double gap = (spread - scale.gap_spread) * scale.gap_slope;
  // Negative where the density is above f_1.
  const double saturation = (scale.saturation - density) * scale.guard_slope;
  return std::min(std::max({phi, guard, gap}), saturation);
}

/// F where no particle reaches.
inline double VoidValue(const Scale& scale) {
  return LevelSetValue(scale, 0, scale.kernel_radius - scale.reference_radius, 0);
}

}  // namespace partiemc
