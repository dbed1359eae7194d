// The sums over particles behind PointField::Sample, in the vectors of the processor at hand.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "crossings.h"
#include "near_rows.h"

namespace partiemc {

/// Up to kPointsAtOnce points, in cells relative to the tile, and the particles around them, at
/// least those within R of each.
struct PointQuery {
  NearRows near;
  std::array<LatticePoint, kPointsAtOnce> points;
  std::size_t count;  ///< Of points.
};

/// What all queries have in common.
struct PointKernel {
  double inverse_square;  ///< 1 / R^2
  double uniform_weight;  ///< w, where particles have no weights of their own.
};

/// Sums over the particles within R of a point; d = x_i - x, a and b stand for x and y.
struct PointSums {
  double kernel;                ///< sum k
  double moment_x, moment_y;    ///< sum k d
  double slope_x, slope_y;      ///< sum dk / da
  double kxx, kxy, kyy;         ///< sum k d_a d_b
  double xx, xy, yy;            ///< sum (dk / da) d_b, the same for a and b exchanged
  double density;               ///< sum w k
  double density_x, density_y;  ///< sum w dk / da
};

/// More of them, which few points ask for: sum (dk / da) d_b d_c, the same in any order.
struct PointThirdSums {
  double xxx, xxy, xyy, yyy;
};

/// sums[k][i] are those at points[i] of queries[k], at most kQueriesAtOnce, all or none of them
/// with weights. Terms are floats, and so are their sums over up to 128 particles: off by a few
/// 1e-7 of the sum of their magnitudes. Same bits for any processor, whatever is asked at once: a
/// query's particles within reach are dealt to sixteen partial sums by their place among them, and
/// the sixteen are added up in one order (near_lanes-inl.h).
using QuerySums = std::array<PointSums, kPointsAtOnce>;
void SumAtPoints(const PointKernel& kernel, std::span<const PointQuery> queries,
                 std::span<QuerySums> sums);
PointThirdSums ThirdSumsAtPoint(const PointKernel& kernel, const NearRows& near,
                                const LatticePoint& point);

}  // namespace partiemc
