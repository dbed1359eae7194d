// The local motion of particles between two frames: an affine map for each cell of a grid, fitted
// to the displacements of the particles around the cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "partiemc/parameters.h"
#include "periodic/cell_groups.h"

namespace partiemc {

/// Side of a cell, in spacings; more in a periodic box, so that whole cells fit.
inline constexpr double kMotionCell = 3;

/// Cells up to this number of cells away contribute to a fit, with weights that fall linearly to 0
/// one cell farther.
inline constexpr int kMotionReach = 2;

/// If the mean displacements of two cells differ by this or more, in spacings, the cells belong to
/// different bodies and do not contribute to each other.
inline constexpr double kMotionDifference = .7;

/// Added to the variance of positions along each axis, in squared spacings, to damp the slope of a
/// fit. A fit to particles close together is thus nearly their mean displacement, and a fit to
/// particles on a line has a solution.
inline constexpr double kMotionRidge = .25;

/// The grid of cells. Lengths in spacings. With two axes, the third coordinate is 0.
struct MotionGrid {
  int axes = 2;                           ///< 2 or 3.
  std::array<double, 3> origin{};         ///< Lower end of the box; 0 without a period.
  std::array<double, 3> length{};         ///< Period; 0: none.
  std::array<double, 3> side{1, 1, 1};    ///< Cell side.
  std::array<std::int32_t, 3> periods{};  ///< Cells along a period; 0: not periodic.
};

/// `axes`: the coordinates that are filtered; 0, 1, 2 for x, y, z. `spacing` is in world units.
/// Requires: Validate has passed the box for this spacing.
MotionGrid MakeMotionGrid(std::span<const int> axes, const std::optional<PeriodicBox>& box,
                          double spacing);

/// A particle that both frames have. Lengths in spacings.
struct Mover {
  Vec3 at;     ///< Position in this frame, relative to the centre of its cell.
  Vec3 moved;  ///< Displacement since the last frame.
};

/// The particles of one cell and their moments.
struct MotionCell {
  GridCell at{};                      ///< z, y, x, so that cells are sorted by layer, row, column.
  std::uint32_t first = 0, last = 0;  ///< Its movers, [first, last).
  Vec3 mean_at, mean_moved;
  /// Sums of the outer products at at^T and at moved^T, about the means.
  std::array<Vec3, 3> square{}, product{};
};

/// Returns the cell of a position (MotionCell::at), and sets `at` to the position relative to the
/// centre of the cell. Both in spacings. Positions too far away for the grid share its outermost
/// cells.
GridCell CellOf(const MotionGrid& grid, const Vec3& position, Vec3& at);

/// Sets the moments of cells from their movers. Parallel over cells.
void SumMoments(std::span<const Mover> movers, std::span<MotionCell> cells);

/// An affine map from a position in a cell, relative to its centre, to a displacement.
struct LocalMotion {
  Vec3 centre, mean;
  std::array<Vec3, 3> slope{};

  Vec3 At(const Vec3& at) const {
    const Vec3 from = at - centre;
    return mean + from.x * slope[0] + from.y * slope[1] + from.z * slope[2];
  }
};

/// Fits the motion of one cell to the cells within kMotionReach by weighted least squares, with a
/// ridge. Near cells with similar motions weigh most. Requires: `cells` are sorted and have
/// moments. Deterministic: sums have a fixed order. Cost: (2 kMotionReach + 1)^(axes - 1) binary
/// searches, three times as many if x is periodic.
LocalMotion FitMotion(const MotionGrid& grid, std::span<const MotionCell> cells, std::size_t cell);

}  // namespace partiemc
