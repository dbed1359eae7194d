// The sums over particles behind the support of a virtual plane, in the vectors of the processor
// at hand.
#pragma once

#include "point_field.h"

namespace partiemc {

/// Which particles support a plane, lengths in cells: those in a disc around its point, up to a
/// height above it, weighted by B(along, half_width) max(0, distance / spacing + depth)^8.
struct SupportShape {
  double radius, half_width, height, spacing;
  double depth;  ///< In spacings.
};

/// A plane bent to a parabola, in cells relative to a tile.
struct BentPlane {
  double x, y;
  double normal_x, normal_y;  ///< Unit.
  double curvature;
};

/// Weighted sum of the particles' distances to the parabola, positive above it.
struct SupportSums {
  double distance, weight;
};

/// Sums over the particles of `near`, which lists all in the disc and may list more. Same bits for
/// any processor, as SumAtPoint.
SupportSums SumSupport(const NearRows& near, const SupportShape& shape, const BentPlane& plane);

}  // namespace partiemc
