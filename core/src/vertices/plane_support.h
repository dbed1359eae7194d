// Sums over the particles that support a virtual plane (core/METHOD.md, "The default placement",
// step 3). Vectorised with run-time dispatch.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "sampler/neighbour_query.h"

namespace partiemc {

/// Selects and weighs the particles that support a plane. A particle supports a plane if it is
/// nearer to the plane's point than `radius`, and less than `height` above the plane. The weight of
/// a particle is B(distance, radius) max(0, u / spacing + depth)^8, where u is its height above the
/// bent plane. Lengths in cells.
///
/// If sizes differ, lengths are those of a place of size 1: distances are divided by the plane's
/// size. A particle counts by the height of its boundary, half its size above it, less half a
/// spacing. Its weight has its size as a factor, since it covers that much of the boundary.
struct SupportShape {
  double radius;
  /// Half a spacing if sizes differ, else 0: a particle is farther from its boundary than a
  /// particle of the plane's size by at most this times the larger of both sizes.
  double lift = 0;
  double height, spacing;
  double depth;  ///< In spacings.
};

/// A plane bent to a parabola through (x, y), in cells relative to a tile.
struct BentPlane {
  double x, y;
  double normal_x, normal_y;  ///< Unit.
  double curvature;
  double size = 1;  ///< The local size, in spacings.
};

/// Sums over the particles that support a plane: of weights, of weighted heights above the
/// parabola, and of weighted squared heights.
struct SupportSums {
  double weight, distance, square;
};

/// Up to kPointsAtOnce planes. `near` contains at least the particles that may support them, with
/// sizes if sizes differ.
struct SupportQuery {
  NeighbourRows near;
  std::span<const BentPlane> planes;
};

using QuerySupports = std::array<SupportSums, kPointsAtOnce>;

/// Computes sums[k][i] for planes[i] of queries[k]. Float arithmetic in a fixed order: the bits are
/// the same on any processor, as in SampleAtPoints (point_kernels.h).
/// Requires: at most kQueriesAtOnce queries.
void SumSupports(std::span<const SupportQuery> queries, const SupportShape& support,
                 std::span<QuerySupports> sums);

}  // namespace partiemc
