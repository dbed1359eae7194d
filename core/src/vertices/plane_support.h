// The sums over particles that say where a virtual plane belongs, in the vectors of the processor
// at hand.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "sampler/neighbour_query.h"

namespace partiemc {

/// Which particles support a plane, lengths in cells: those nearer to its point than a radius and
/// not higher above it than a height, weighted by B(apart, radius) max(0, distance / spacing +
/// depth)^8.
struct SupportShape {
  double radius, height, spacing;
  double depth;  ///< In spacings.
};

/// A plane bent to a parabola, in cells relative to a tile.
struct BentPlane {
  double x, y;
  double normal_x, normal_y;  ///< Unit.
  double curvature;
};

/// Over the particles of a support: the sums of their weights, of their weighted distances to the
/// parabola, positive above it, and of the squares of these.
struct SupportSums {
  double weight, distance, square;
};

/// Up to kPointsAtOnce planes, and at least the particles in the disc of each.
struct SupportQuery {
  NeighbourRows near;
  std::span<const BentPlane> planes;
};

/// sums[k][i] are those of planes[i] of queries[k], at most kQueriesAtOnce. In floats, with the
/// same bits for any processor, as SumAtPoints.
using QuerySupports = std::array<SupportSums, kPointsAtOnce>;
void SumSupports(std::span<const SupportQuery> queries, const SupportShape& support,
                 std::span<QuerySupports> sums);

}  // namespace partiemc
