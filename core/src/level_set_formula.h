// The level set as a function of the density f and of phi = |x - xbar| - r (core/METHOD.md).
#pragma once

#include <algorithm>

#include "scale.h"

namespace partiemc {

/// F = min(max(phi, (g - f) R / 1.164), (t - f) R / 1.164), in cells. Where f is at most g, or
/// above t, the density alone decides the side: phi is asked in between only. All branches are
/// lengths. Real is float at nodes, double at points.
template <typename Real>
class LevelSetFormula {
 public:
  explicit LevelSetFormula(const Scale& scale)
      : guard_(static_cast<Real>(scale.guard)),
        saturation_(static_cast<Real>(scale.saturation)),
        slope_(static_cast<Real>(scale.guard_slope)) {}

  bool IsSurelyOutside(Real density) const { return density <= guard_; }
  bool IsSurelyInside(Real density) const { return density > saturation_; }

  /// Positive where the density is below g: the inner bound of max(phi, .).
  Real Guard(Real density) const { return (guard_ - density) * slope_; }
  /// Negative where the density is above t.
  Real Saturation(Real density) const { return (saturation_ - density) * slope_; }

  Real Value(Real density, Real phi) const {
    return std::min(std::max(phi, Guard(density)), Saturation(density));
  }

 private:
  Real guard_, saturation_, slope_;
};

}  // namespace partiemc
