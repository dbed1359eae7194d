// The level set as a function of the kernel's moments at a point (core/METHOD.md).
#pragma once

#include <algorithm>
#include <cmath>

#include "scale.h"

namespace partiemc {

/// Larger eigenvalue of the symmetric matrix (xx xy; xy yy), which has no negative one.
template <typename Real>
Real LargerEigenvalue(Real xx, Real xy, Real yy) {
  const Real half = (xx - yy) / 2;
  return (xx + yy) / 2 + std::sqrt(half * half + xy * xy);
}

/// F = min(max(phi, (g - f) R / 1.164, (s - s0) R / 0.45), (t - f) R / 1.164), in cells, from
///   the density f;
///   phi = |x - xbar| - r;
///   the spread s, the larger eigenvalue of sum k d d^T / (R^2 sum k), d = x_i - x.
/// Where f is at most g, or above t, the density alone decides the side: phi and s are asked in
/// between only. All branches are lengths. Real is float at nodes, double at points.
template <typename Real>
class LevelSetFormula {
 public:
  explicit LevelSetFormula(const Scale& scale)
      : guard_(static_cast<Real>(scale.guard)),
        saturation_(static_cast<Real>(scale.saturation)),
        slope_(static_cast<Real>(scale.guard_slope)),
        gap_spread_(static_cast<Real>(scale.gap_spread)),
        gap_slope_(static_cast<Real>(scale.gap_slope)) {}

  bool IsSurelyOutside(Real density) const { return density <= guard_; }
  bool IsSurelyInside(Real density) const { return density > saturation_; }

  /// Positive where the density is below g.
  Real Guard(Real density) const { return (guard_ - density) * slope_; }
  /// Positive between bodies, where particles are on both sides and none is near.
  Real Gap(Real spread) const { return (spread - gap_spread_) * gap_slope_; }
  /// Negative where the density is above t.
  Real Saturation(Real density) const { return (saturation_ - density) * slope_; }

  Real Value(Real density, Real phi, Real spread) const {
    return std::min(std::max({phi, Guard(density), Gap(spread)}), Saturation(density));
  }

 private:
  Real guard_, saturation_, slope_, gap_spread_, gap_slope_;
};

}  // namespace partiemc
