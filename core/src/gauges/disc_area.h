// The area of a disc inside a box.
#pragma once

#include "base/point.h"

namespace partiemc {

/// The exact area of the part of a disc inside an axis-parallel box, up to rounding.
/// Requires: radius >= 0, min.x <= max.x, min.y <= max.y.
double DiscAreaInBox(const Point& centre, double radius, const Point& min, const Point& max);

}  // namespace partiemc
