// The sums over particles behind PointField::Sample, in the vectors of the processor at hand.
#pragma once

#include <array>
#include <cstdint>

namespace partiemc {

/// Entries in memory that one query looks at: row after row of buckets, each a contiguous span.
struct PointQuery {
  double x, y;            ///< The point.
  double inverse_square;  ///< 1 / R^2
  double uniform_weight;  ///< w, where `weight` is null.
  const float* entry_x;
  const float* entry_y;
  const float* weight;
  const std::uint32_t* offsets;  ///< First bucket of the first row.
  int rows, columns;             ///< Buckets to look at.
  int row_stride;                ///< Buckets from one row to the next.
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

/// Entries are dealt to four partial sums by their place in their row, whatever the width of the
/// processor's vectors, and the four are added in one order: the bits are the same everywhere.
/// Reads up to kPointPadding entries past the end of a row.
inline constexpr int kPointPadding = 4;
PointSums SumAtPoint(const PointQuery& query);
/// The same of two points that look at the same entries in memory, at once where vectors are wide
/// enough: what their rows have in common in length costs once. Best for points that are
/// neighbours.
std::array<PointSums, 2> SumAtTwoPoints(const PointQuery& first, const PointQuery& second);
PointThirdSums ThirdSumsAtPoint(const PointQuery& query);

}  // namespace partiemc
