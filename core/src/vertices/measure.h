// Measures area, perimeter and centroid of rings.
#pragma once

#include <span>

#include "partiemc/result.h"

namespace partiemc {

/// Measures a closed ring of interleaved points; particle_count and identity are 0. Coordinates are
/// taken relative to the first point, so that a ring far from the origin loses no digits.
/// Requires: at least one point.
RingMeasures MeasureRing(std::span<const double> points);

/// Measures all rings, in parallel.
void MeasureRings(Rings& rings);

}  // namespace partiemc
