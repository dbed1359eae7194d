// Area and centroid of the inside of the rings in a box.
#pragma once

#include "base/point.h"
#include "partiemc/result.h"

namespace partiemc {

struct BoxArea {
  double area = 0;
  Point centroid;  ///< NaN if the area is 0.
};

/// Clips each ring to the box (Sutherland and Hodgman, Comm. ACM 17, 1974). Where a clipped ring
/// runs along the box forwards and backwards, both parts cancel in the sums.
/// Requires: min.x < max.x, min.y < max.y. Cost: linear in the points.
BoxArea AreaInBox(const Rings& rings, const Point& min, const Point& max);

}  // namespace partiemc
