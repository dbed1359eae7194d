// The sums over particles behind PointField::Sample, in the vectors of the processor at hand.
#pragma once

#include <span>

#include "crossings.h"
#include "near_rows.h"

namespace partiemc {

/// The particles around a few points, at least those within R of each.
struct PointQuery : NearRows {
  double inverse_square;  ///< 1 / R^2
  double uniform_weight;  ///< w, where `weight` is null.
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

/// sums[k] are those at points[k], in cells relative to the tile; at most kPointsAtOnce. Terms are
/// floats, and so are their sums over up to 256 particles: off by a few 1e-7 of the sum of their
/// magnitudes. Same bits for any processor: particles are dealt to sixteen partial sums by their
/// place among those of the query, and the sixteen are added up in one order (near_lanes-inl.h).
void SumAtPoints(const PointQuery& query, std::span<const LatticePoint> points,
                 std::span<PointSums> sums);
PointThirdSums ThirdSumsAtPoint(const PointQuery& query, const LatticePoint& point);

}  // namespace partiemc
