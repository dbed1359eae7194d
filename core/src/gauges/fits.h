// Fits of simple curves to parts of a ring, for angles.
#pragma once

#include <optional>
#include <span>

#include "base/point.h"

namespace partiemc {

struct Circle {
  Point centre;
  double radius = 0;
};

/// The circle of Taubin's fit, which short arcs bias little (G. Taubin, IEEE PAMI 13, 1991;
/// Newton's iteration of N. Chernov, Circular and Linear Regression, 2010). Empty for fewer than
/// four points, and for points on a straight line.
std::optional<Circle> FitCircle(std::span<const Point> points);

/// The slope of the least-squares line y(x). Empty for fewer than two different x.
std::optional<double> FitSlope(std::span<const Point> points);

}  // namespace partiemc
