// The level set as a function of the kernel's moments (core/METHOD.md).
#pragma once

#include <algorithm>
#include <cmath>

#include "frame/scale.h"

namespace partiemc {

/// The larger eigenvalue of the symmetric matrix (xx xy; xy yy).
inline double LargerEigenvalue(double xx, double xy, double yy) {
  const double half = (xx - yy) / 2;
  return (xx + yy) / 2 + std::sqrt(half * half + xy * xy);
}

/// F = min(max(phi, (f_0 - f) R / 1.164, (sigma - sigma_0) R / 0.45), (f_1 - f) R / 1.164), in
/// cells.
///   f: density; phi = |x - xbar| - r_0;
///   sigma: spread, the larger eigenvalue of sum k D D^T / (R^2 sum k), D = x_i - x.
/// A point is outside if f <= f_0 and inside if f > f_1, whatever phi and sigma are. All terms are
/// lengths. NodeFormula (tile_kernels.cc) computes the same formula in vectors, PointFormula
/// (point_formula-inl.h) also its gradient.
inline double LevelSetValue(const Scale& scale, double density, double phi, double spread) {
  // Positive if the density is below f_0.
  const double guard = (scale.guard - density) * scale.guard_slope;
  // Positive between bodies: particles are on both sides, but none is near.
  const double gap = (spread - scale.gap_spread) * scale.gap_slope;
  // Negative if the density is above f_1.
  const double saturation = (scale.saturation - density) * scale.guard_slope;
  return std::min(std::max({phi, guard, gap}), saturation);
}

/// F at a point that no kernel reaches.
inline double VoidValue(const Scale& scale) {
  return LevelSetValue(scale, 0, scale.kernel_radius - scale.reference_radius, 0);
}

}  // namespace partiemc
