// Measures area, perimeter and centroid of rings.
#pragma once

#include <span>

#include "partiemc/result.h"
#include "rings/percolation.h"

namespace partiemc {

/// Measures a closed ring of interleaved points; leaves particle_count and identity 0. A ring far
/// from the origin loses no digits, because sums are relative to its first point. The centroid of a
/// ring without area is its first point. Requires: at least one point.
RingMeasures MeasureRing(std::span<const double> points);

struct WindowMeasures {
  double area = 0;       ///< Signed area of the part of the ring's inside that lies in the window.
  double perimeter = 0;  ///< Length of the ring's part in the window, without the window's sides.
};

/// Measures the part of a ring in a window. `sizes`: by point; each piece of the perimeter then
/// counts times the mean of both points of its segment. Empty: all are 1. Requires: at least one
/// point.
WindowMeasures MeasureInWindow(std::span<const double> points, const Window& window,
                               std::span<const float> sizes = {});

void MeasureRings(Rings& rings);

}  // namespace partiemc
