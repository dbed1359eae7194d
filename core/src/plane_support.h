// The sums over particles that say where a virtual plane belongs, in the vectors of the processor
// at hand.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "near_rows.h"

namespace partiemc {

/// Which particles support a plane, lengths in cells: those in a disc around its point, up to a
/// height above it, weighted by B(along, half_width) max(0, distance / spacing + depth)^8.
struct SupportShape {
  double radius, half_width, height, spacing;
  double depth;  ///< In spacings.
};

/// Which particles count as volume below a plane, lengths in cells: those in a disc around its
/// point, up to a height above it, by B(along, half_width) B(min(distance, 0), depth).
struct StripShape {
  double radius, half_width, height, depth;
};

/// A plane bent to a parabola, in cells relative to a tile.
struct BentPlane {
  double x, y;
  double normal_x, normal_y;  ///< Unit.
  double curvature;
};

/// Over the particles of a support: the weighted sum of their distances to the parabola, positive
/// above it, and the sum of those weights. Over those of a strip: the sum of their weights in the
/// field, or their number where all weigh the same.
struct SupportSums {
  double distance, weight;
  double volume;
};

/// Up to kPointsAtOnce planes, and at least the particles in both discs of each.
struct SupportQuery {
  NearRows near;
  std::span<const BentPlane> planes;
};

/// sums[k][i] are those of planes[i] of queries[k], at most kQueriesAtOnce, all or none of them
/// with weights. In floats, with the same bits for any processor, as SumAtPoints.
using QuerySupports = std::array<SupportSums, kPointsAtOnce>;
void SumSupports(std::span<const SupportQuery> queries, const SupportShape& support,
                 const StripShape& strip, std::span<QuerySupports> sums);

}  // namespace partiemc
