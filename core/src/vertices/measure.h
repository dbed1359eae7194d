// Area, perimeter and centroid of a ring.
#pragma once

#include <span>

#include "partiemc/result.h"

namespace partiemc {

/// Measures a closed ring of interleaved points, at least one; particle_count and identity are 0.
/// Relative to the first point, so that a ring far from the origin loses no digits.
RingMeasures MeasureRing(std::span<const double> points);

/// All of them, in parallel.
void MeasureRings(Rings& rings);

}  // namespace partiemc
