// The curve of an interface near a junction: a line or a circle, fitted to its points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "base/point.h"

namespace partiemc {

/// Distance from the junction along the interface, in spacings. The fit of a curve ignores nearer
/// points, because the kernel rounds the corner of each phase at the junction.
inline constexpr double kCurveNearest = 1.5;
/// Distances as kCurveNearest, in spacings. Points up to kCurveFarthest determine the place and the
/// direction of the curve, points up to kCurvatureFarthest its curvature.
inline constexpr double kCurveFarthest = 5, kCurvatureFarthest = 9;

/// `noise` of ArcCurveFit::Fit for a curve that determines the place of a junction. This is the
/// square of a limit in standard errors: a bend of less than ten standard errors becomes 0. The
/// limit is high for two reasons. Smoothing correlates the deviations of neighbouring points, so
/// the computed standard error is too small. And the curve is extrapolated to the junction, which
/// magnifies an error of the bend.
inline constexpr double kPlaceNoise = 100;

struct Line {
  Point through;
  Point along;  ///< Unit.
};

/// A circle, or a line if `bend` is 0: n = offset + slope t + bend (t^2 + n^2). t and n are the
/// coordinates along `along` and to the left of it, from an origin near the junction.
struct ArcCurve {
  Point along;  ///< Unit. From the origin towards the points.
  double offset = 0, slope = 0, bend = 0;

  /// The tangent at the point of the curve nearest to `at`, by one Newton step. Its error is of the
  /// second order in the distance of `at` from the curve. `at` and the tangent are relative to the
  /// origin of the curve.
  Line TangentNear(const Point& at) const;
  /// The direction of TangentNear(at), of unit length, with the sign that agrees with `along`.
  Point DirectionAt(const Point& at) const;
  /// The distance of a point from the curve, to the first order; positive on the left of `along`.
  double MisfitOf(const Point& at) const;
};

/// Fits an ArcCurve by least squares. Points are relative to one origin near the junction.
class ArcCurveFit {
 public:
  /// `distance`: from the junction along the interface, in spacings. Ignores points that do not
  /// determine the curve.
  void Add(const Point& at, double distance);
  /// Adds the junction itself.
  void AddEnd(const Point& at);
  /// Absent if fewer than two of the points with distances in [kCurveNearest, kCurveFarthest] were
  /// added, or if these coincide. The bend is fitted to the points with distances up to
  /// kCurvatureFarthest. It is 0 if these are fewer than five. Otherwise it is multiplied by
  /// max(0, 1 - noise * v / bend^2), with the variance v of the fitted bend. A point of AddEnd
  /// counts for both.
  std::optional<ArcCurve> Fit(double noise) const;

 private:
  // Sums over points, with q = x^2 + y^2. A turned frame has the same q.
  struct Sums {
    double count = 0, x = 0, y = 0, q = 0, xx = 0, xy = 0, yy = 0, xq = 0, yq = 0, qq = 0;

    void Add(const Point& at);
  };
  // Means, and sums of products of deviations, along (t) and across (n) a curve.
  struct Moments {
    double t, n, q;
    double tt, tn, nn, tq, nq, qq;
  };
  static Moments MomentsOf(const Sums& sums, const Point& along);
  static double BendOf(const Sums& sums, const Point& along, double noise);

  Sums near_, wide_;
};

/// The curve of points along a path, relative to `junction`, where the path begins. `path[k]` is
/// the number of a point in `positions`. Lengths are in cells.
template <typename Path>
std::optional<ArcCurve> CurveAlong(const Path& path, const Point& junction, double spacing,
                                   std::span<const Point> positions) {
  ArcCurveFit fit;
  Point last = junction;
  double distance = 0;
  for (std::size_t k = 0; k < path.size() && distance <= kCurvatureFarthest; ++k) {
    const Point& at = positions[path[k]];
    distance += Length(Minus(at, last)) / spacing;
    last = at;
    fit.Add(Minus(at, junction), distance);
  }
  return fit.Fit(kPlaceNoise);
}

/// The inner points of an arc in order from its start (`is_start`), or in reverse from its end.
class ArcPath {
 public:
  ArcPath(std::span<const std::uint32_t> inner, bool is_start)
      : inner_(inner), is_start_(is_start) {}
  std::size_t size() const { return inner_.size(); }
  std::uint32_t operator[](std::size_t k) const {
    return inner_[is_start_ ? k : inner_.size() - 1 - k];
  }

 private:
  std::span<const std::uint32_t> inner_;
  bool is_start_;
};

}  // namespace partiemc
