// Measures area, perimeter and centroid of rings.
#pragma once

#include <span>

#include "partiemc/result.h"
#include "rings/percolation.h"

namespace partiemc {

/// Measures a closed ring of interleaved points; particle_count and identity are 0. Coordinates are
/// taken relative to the first point, so that a ring far from the origin loses no digits.
/// Requires: at least one point.
RingMeasures MeasureRing(std::span<const double> points);

struct WindowMeasures {
  double area = 0;       ///< Signed area of the part of a ring's inside that lies in the window.
  double perimeter = 0;  ///< Length of the ring's part in the window, without its sides.
};

/// Measures the part of a ring in a window. Requires: at least one point.
WindowMeasures MeasureInWindow(std::span<const double> points, const Window& window);

/// Measures all rings, in parallel.
void MeasureRings(Rings& rings);

}  // namespace partiemc
