// The level set on a plane through particles in space, as a function of the kernel's moments
// (core/METHOD.md, "Slices").
#pragma once

#include <algorithm>
#include <cmath>

#include "base/point.h"
#include "field/level_set_formula.h"
#include "frame/scale.h"

namespace partiemc {

/// Position of a particle relative to a point of the plane, in cells.
struct SpaceOffset {
  double x, y;    ///< Along the plane.
  double height;  ///< Above the plane.
};

/// Sums over the particles around a point of the plane; D = x_i - x in space.
struct SliceSums {
  double kernel = 0;              ///< sum k
  double density = 0;             ///< f = sum w k
  double x = 0, y = 0, z = 0;     ///< sum k D
  double xx = 0, xy = 0, yy = 0;  ///< sum k D D^T
  double xz = 0, yz = 0, zz = 0;

  /// Adds a particle of weight w. Requires: `within` = 1 - abs(D)^2 / R^2 > 0.
  void Add(const SpaceOffset& to, double within, double weight) {
    const double k = within * within * within;
    kernel += k;
    density += weight * k;
    const double kx = k * to.x, ky = k * to.y, kz = k * to.height;
    x += kx;
    y += ky;
    z += kz;
    xx += kx * to.x;
    xy += kx * to.y;
    yy += ky * to.y;
    xz += kx * to.height;
    yz += ky * to.height;
    zz += kz * to.height;
  }

  /// abs(x - xbar) - r_0, in space. Requires: kernel > 0.
  double Phi(const Scale& scale) const {
    return std::sqrt(x * x + y * y + z * z) / kernel - scale.reference_radius;
  }

  /// sigma: an upper bound of the largest eigenvalue of the moments, divided by R^2 sum k. The
  /// bound is exact if the height is correlated only with the larger principal axis of the moments
  /// in the plane, as between two flat bodies in any position. The bound is also exact inside
  /// bodies, where moments are isotropic.
  double Spread(const Scale& scale) const {
    const double along = LargerEigenvalue(xx, xy, yy);
    const double across = std::sqrt(xz * xz + yz * yz);
    return LargerEigenvalue(along, across, zz) /
           (scale.kernel_radius * scale.kernel_radius * kernel);
  }

  /// F at the point.
  double Value(const Scale& scale) const {
    if (kernel <= 0) return VoidValue(scale);
    return LevelSetValue(scale, density, Phi(scale), Spread(scale));
  }
};

/// Sums for the gradients of SliceSums along the plane, over the same particles. With
/// t = 1 - abs(D)^2 / R^2: grad k = 6 t^2 D / R^2.
struct SliceSlopes {
  double x = 0, y = 0;            ///< sum t^2 D
  double xx = 0, xy = 0, yy = 0;  ///< sum t^2 D D^T
  double xz = 0, yz = 0;
  double density_x = 0, density_y = 0;  ///< sum w t^2 D

  void Add(const SpaceOffset& to, double within, double weight) {
    const double square = within * within;
    const double slope_x = square * to.x, slope_y = square * to.y;
    x += slope_x;
    y += slope_y;
    xx += slope_x * to.x;
    xy += slope_x * to.y;
    yy += slope_y * to.y;
    xz += slope_x * to.height;
    yz += slope_y * to.height;
    density_x += weight * slope_x;
    density_y += weight * slope_y;
  }

  Point OfDensity(const Scale& scale) const {
    const double six = 6 / (scale.kernel_radius * scale.kernel_radius);
    return {six * density_x, six * density_y};
  }

  /// grad phi = m . grad m / |m| with the mean m = sum k D / sum k and
  ///   grad m = (sum grad k D^T - m sum grad k) / sum k - I.
  /// 0 if m = 0. Requires: sums.kernel > 0.
  Point OfPhi(const SliceSums& sums, const Scale& scale) const {
    const double length = std::sqrt(sums.x * sums.x + sums.y * sums.y + sums.z * sums.z);
    if (length == 0) return {};
    const double six = 6 / (scale.kernel_radius * scale.kernel_radius);
    const double nx = sums.x / length, ny = sums.y / length, nz = sums.z / length;
    const double mean = length / sums.kernel;
    return {six * (nx * xx + ny * xy + nz * xz - mean * x) / sums.kernel - nx,
            six * (nx * xy + ny * yy + nz * yz - mean * y) / sums.kernel - ny};
  }
};

}  // namespace partiemc
