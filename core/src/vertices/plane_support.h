// Sums over the particles that support a virtual plane (core/METHOD.md, "The default placement",
// step 3). Vectorised with run-time dispatch.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "sampler/neighbour_query.h"

namespace partiemc {

/// Selects and weighs the particles that support a plane. A particle supports a plane if it is
/// nearer to the plane's point than `radius`, and less than `height` above the plane. With the
/// height u above the bent plane, the particle's weight is the product of B(distance, radius) and
/// max(0, u / spacing + depth)^8. Here B(d, r) = max(0, 1 - d^2 / r^2)^2. Lengths are in cells.
///
/// If sizes differ, all distances are divided by the plane's size. The height of a particle is then
/// the height of its boundary, half its size above its centre, less half a spacing. The weight has
/// the further factor particle's size / plane's size, because a large particle covers more of the
/// boundary.
struct SupportShape {
  double radius;
  /// Half a spacing if sizes differ, else 0. Heights of boundaries differ from heights of centres
  /// by at most this times the larger of the particle's and the plane's size.
  double lift = 0;
  double height, spacing;
  double depth;  ///< In spacings.
};

/// A plane, bent to a parabola that touches it at (x, y), in cells relative to a tile.
struct BentPlane {
  double x, y;
  double normal_x, normal_y;  ///< Unit.
  double curvature;           ///< Per cell; positive where the boundary is convex.
  double size = 1;            ///< The local size, in spacings.
};

/// Sums over the particles that support a plane: weights, weighted heights above the parabola, and
/// weighted squares of these heights.
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
/// Requires: 1 to kQueriesAtOnce queries.
void SumSupports(std::span<const SupportQuery> queries, const SupportShape& support,
                 std::span<QuerySupports> sums);

}  // namespace partiemc
