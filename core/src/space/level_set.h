// The level set in space as a function of the kernel's moments (core/METHOD.md, "Notation",
// "Slices").
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "base/vec3.h"
#include "field/level_set_formula.h"
#include "frame/scale.h"

namespace partiemc::space {

/// A symmetric 3 x 3 matrix.
struct Symmetric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  Vec3 Times(const Vec3& v) const {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z};
  }
};

/// The largest eigenvalue, to 2e-8 of the largest entry. No transcendental function: with the mean
/// q of the diagonal and p^2 = |A - q I|^2 / 6, the eigenvalue is q + p (1 + s), where s is the
/// root in [0, 1] of s sqrt(3 + s) = 2 u, u^2 = (1 + det((A - q I) / p) / 2) / 2.
inline double LargestEigenvalue(const Symmetric& a) {
  const double q = (a.xx + a.yy + a.zz) / 3;
  const double x = a.xx - q, y = a.yy - q, z = a.zz - q;
  const double square = (x * x + y * y + z * z + 2 * (a.xy * a.xy + a.xz * a.xz + a.yz * a.yz)) / 6;
  if (!(square > 0)) return q;
  const double p = std::sqrt(square);
  const double determinant =
      x * (y * z - a.yz * a.yz) - a.xy * (a.xy * z - a.yz * a.xz) + a.xz * (a.xy * a.yz - y * a.xz);
  const double u = std::sqrt(std::clamp(.5 + determinant / (4 * square * p), 0.0, 1.0));
  constexpr double kFirst = 1.1547005383792515;  // 2 / sqrt(3), the slope at u = 0.
  double s = u * (kFirst + (1 - kFirst) * u);
  for (int round = 0; round < 2; ++round) {
    const double root = std::sqrt(3 + s);
    s -= (s * root - 2 * u) / (root + s / (2 * root));
  }
  return q + p * (1 + s);
}

/// A unit eigenvector of the eigenvalue `value`: the longest cross product of two rows of A - value
/// I. 0 if all products are 0, as for a triple eigenvalue. Inaccurate if another eigenvalue is
/// nearly the same.
inline Vec3 Eigenvector(const Symmetric& a, double value) {
  const Vec3 rows[3] = {
      {a.xx - value, a.xy, a.xz}, {a.xy, a.yy - value, a.yz}, {a.xz, a.yz, a.zz - value}};
  Vec3 longest;
  for (int k = 0; k < 3; ++k) {
    const Vec3 product = Cross(rows[k], rows[(k + 1) % 3]);
    if (Dot(product, product) > Dot(longest, longest)) longest = product;
  }
  return Normalised(longest);
}

/// Sums over the particles i around a point x, with D = (x_i - x) / s, k = max(0, 1 - |D|^2 /
/// R^2)^3 and the weight w. s is the own size of a particle in spacings, 1 for equal sizes.
struct Sums {
  double kernel = 0;   ///< sum k
  double density = 0;  ///< f = sum w k
  Vec3 first;          ///< sum k D
  Symmetric second;    ///< sum k D D^T
  double size = 1;     ///< The local size (sum k s) / (sum k).
};

/// Sums for the gradients of Sums. With t = max(0, 1 - |D|^2 / R^2), grad k = 6 t^2 D / (R^2 s).
struct Slopes {
  Vec3 first;           ///< sum t^2 D / s
  Symmetric second;     ///< sum t^2 D D^T / s
  Vec3 density;         ///< sum w t^2 D / s
  double per_size = 1;  ///< (sum k / s) / (sum k)
};

enum class Term { kPhi, kGuard, kGap, kSaturation };

/// F at a point, in cells, and the term of F that has this value.
struct LevelSetAt {
  double value;
  Term term;
};

inline double SpreadOf(const Sums& sums, const Scale& scale) {
  return LargestEigenvalue(sums.second) / (scale.kernel_radius * scale.kernel_radius * sums.kernel);
}

/// If true, the gap term of F is below `value`; if false, nothing is known. Saves most eigenvalues
/// near surfaces: in the notation of LargestEigenvalue, the eigenvalue is at most q + 2 p.
inline bool IsGapBelow(const Sums& sums, const Scale& scale, double value) {
  // Above the error of LargestEigenvalue and all rounding.
  constexpr double kMargin = 1e-6;
  const double limit = (value / scale.gap_slope + scale.gap_spread) *
                       (scale.kernel_radius * scale.kernel_radius * sums.kernel);
  const Symmetric& a = sums.second;
  const double q = (a.xx + a.yy + a.zz) / 3, rest = (1 - kMargin) * limit - q;
  const double x = a.xx - q, y = a.yy - q, z = a.zz - q;
  const double square = x * x + y * y + z * z + 2 * (a.xy * a.xy + a.xz * a.xz + a.yz * a.yz);
  return rest > 0 && 4 * square < 6 * (rest * rest);
}

inline LevelSetAt LevelSetOf(const Sums& sums, const Scale& scale) {
  if (!(sums.kernel > 0)) return {VoidValue(scale), Term::kGuard};
  const double phi = Length(sums.first) / sums.kernel - scale.reference_radius;
  const double guard = (scale.guard - sums.density) * scale.guard_slope;
  const double saturation = (scale.saturation - sums.density) * scale.guard_slope;
  LevelSetAt at{phi, Term::kPhi};
  if (guard > at.value) at = {guard, Term::kGuard};
  if (!IsGapBelow(sums, scale, at.value)) {
    const double gap = (SpreadOf(sums, scale) - scale.gap_spread) * scale.gap_slope;
    if (gap > at.value) at = {gap, Term::kGap};
  }
  if (saturation < at.value) at = {saturation, Term::kSaturation};
  at.value *= sums.size;
  return at;
}

/// The gradient of phi = |m| - r_0, m = (sum k D) / (sum k), without the factor of the local size;
/// 0 if m is 0. With n = m / |m|: (sum (D . n) grad k - |m| sum grad k) / (sum k) - per_size n.
inline Vec3 GradientOfPhi(const Sums& sums, const Slopes& slopes, const Scale& scale) {
  const double length = Length(sums.first);
  if (length == 0) return {};
  const double six = 6 / (scale.kernel_radius * scale.kernel_radius);
  const Vec3 n = (1 / length) * sums.first;
  const double mean = length / sums.kernel;
  return (six / sums.kernel) * (slopes.second.Times(n) - mean * slopes.first) - slopes.per_size * n;
}

}  // namespace partiemc::space
