#include "filter/local_motion.h"

#include <algorithm>
#include <cmath>

#include "base/bits.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

// Limit of the coordinates of cells on axes that are not periodic.
constexpr double kMostCells = 1 << 30;

constexpr int kAcross = 2 * kMotionReach + 1;

// Adds weight * a b^T.
void AddProduct(double weight, const Vec3& a, const Vec3& b, std::array<Vec3, 3>& sum) {
  const Vec3 weighted = weight * a;
  sum[0] = sum[0] + weighted.x * b;
  sum[1] = sum[1] + weighted.y * b;
  sum[2] = sum[2] + weighted.z * b;
}

// A cell that contributes to a fit.
struct Contribution {
  const MotionCell* cell;
  Vec3 shift;     // From the centre of the fitted cell to the centre of this cell.
  double weight;  // Per particle.
};

// The cells that contribute to a fit. Allocates nothing.
struct Contributions {
  std::array<Contribution, kAcross * kAcross * kAcross> items;
  std::size_t count = 0;

  std::span<const Contribution> all() const { return std::span(items).first(count); }
};

double Tent(int offset) { return 1 - std::abs(static_cast<double>(offset)) / (kMotionReach + 1); }

// The coordinate `offset` cells beyond `at`, wrapped into the box.
std::int32_t Wrapped(std::int32_t at, int offset, std::int32_t periods) {
  const std::int32_t beyond = at + offset;
  return periods == 0 ? beyond : (beyond % periods + periods) % periods;
}

// 1 for the same mean displacement, 0 from kMotionDifference on. The fourth power spares small
// differences, which noise and strain cause.
double Likeness(const MotionCell& a, const MotionCell& b) {
  const Vec3 apart = b.mean_moved - a.mean_moved;
  const double square = Dot(apart, apart) / (kMotionDifference * kMotionDifference);
  const double left = std::max(0.0, 1 - square * square);
  return left * left;
}

// Adds the cells of one row, including their near images in a periodic box.
void AddRow(const MotionGrid& grid, std::span<const MotionCell> cells, const MotionCell& centre,
            int layer, int row, Contributions& found) {
  const std::int32_t periods = grid.periods[0];
  const int images = periods == 0 ? 0 : 1;
  const std::int32_t z = Wrapped(centre.at[0], layer, grid.periods[2]);
  const std::int32_t y = Wrapped(centre.at[1], row, grid.periods[1]);
  for (int image = -images; image <= images; ++image) {
    const std::int32_t x = centre.at[2] - image * periods;
    const GridCell first{z, y, x - kMotionReach}, last{z, y, x + kMotionReach};
    for (auto cell = std::ranges::lower_bound(cells, first, {}, &MotionCell::at);
         cell != cells.end() && cell->at <= last; ++cell) {
      const int column = cell->at[2] - x;
      const double weight = Tent(layer) * Tent(row) * Tent(column) * Likeness(centre, *cell);
      if (weight == 0) continue;
      const Vec3 shift{column * grid.side[0], row * grid.side[1], layer * grid.side[2]};
      found.items[found.count++] = {&*cell, shift, weight};
    }
  }
}

// Sets `slope` to the solution of (square + ridge) slope = product. `square` is symmetric and not
// negative.
void Solve(std::array<Vec3, 3> square, const std::array<Vec3, 3>& product,
           std::array<Vec3, 3>& slope) {
  square[0].x += kMotionRidge;
  square[1].y += kMotionRidge;
  square[2].z += kMotionRidge;
  const std::array<Vec3, 3> adjugate = {Cross(square[1], square[2]), Cross(square[2], square[0]),
                                        Cross(square[0], square[1])};
  const double scale = 1 / Dot(square[0], adjugate[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& row = adjugate[k];
    slope[k] = scale * (row.x * product[0] + row.y * product[1] + row.z * product[2]);
  }
}

}  // namespace

MotionGrid MakeMotionGrid(std::span<const int> axes, const std::optional<PeriodicBox>& box,
                          double spacing) {
  MotionGrid grid{.axes = static_cast<int>(axes.size())};
  for (std::size_t k = 0; k < axes.size(); ++k) {
    grid.side[k] = kMotionCell;
    if (!box || !box->axes[static_cast<std::size_t>(axes[k])]) continue;
    const PeriodicAxis& axis = *box->axes[static_cast<std::size_t>(axes[k])];
    grid.origin[k] = axis.origin / spacing;
    grid.length[k] = axis.length / spacing;
    grid.periods[k] = static_cast<std::int32_t>(std::max(1.0, grid.length[k] / kMotionCell));
    grid.side[k] = grid.length[k] / grid.periods[k];
  }
  return grid;
}

GridCell CellOf(const MotionGrid& grid, const Vec3& position, Vec3& at) {
  const std::array<double, 3> coordinates{position.x, position.y, position.z};
  std::array<double, 3> local{};
  GridCell cell{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double sides = (coordinates[k] - grid.origin[k]) / grid.side[k];
    double whole = Floor(sides);
    local[k] = std::clamp(sides - whole - .5, -.5, .5) * grid.side[k];
    if (grid.periods[k] > 0) {
      const double periods = grid.periods[k];
      whole = std::clamp(whole - periods * Floor(whole / periods), 0.0, periods - 1);
    }
    cell[2 - k] = static_cast<std::int32_t>(std::clamp(whole, -kMostCells, kMostCells));
  }
  at = {local[0], local[1], grid.axes == 3 ? local[2] : 0};
  return cell;
}

void SumMoments(std::span<const Mover> movers, std::span<MotionCell> cells) {
  ParallelFor(cells.size(), [&](std::size_t k) {
    MotionCell& cell = cells[k];
    const auto own = movers.subspan(cell.first, cell.last - cell.first);
    const double share = 1 / static_cast<double>(own.size());
    Vec3 at, moved;
    for (const Mover& mover : own) {
      at = at + mover.at;
      moved = moved + mover.moved;
    }
    cell.mean_at = share * at;
    cell.mean_moved = share * moved;
    cell.square = cell.product = {};
    for (const Mover& mover : own) {
      const Vec3 from = mover.at - cell.mean_at;
      AddProduct(1, from, from, cell.square);
      AddProduct(1, from, mover.moved - cell.mean_moved, cell.product);
    }
  });
}

LocalMotion FitMotion(const MotionGrid& grid, std::span<const MotionCell> cells, std::size_t cell) {
  Contributions near;
  const int layers = grid.axes == 3 ? kMotionReach : 0;
  for (int layer = -layers; layer <= layers; ++layer) {
    for (int row = -kMotionReach; row <= kMotionReach; ++row) {
      AddRow(grid, cells, cells[cell], layer, row, near);
    }
  }
  LocalMotion motion;
  double total = 0;
  for (const auto& [other, shift, weight] : near.all()) {
    const double all = weight * (other->last - other->first);
    total += all;
    motion.centre = motion.centre + all * (other->mean_at + shift);
    motion.mean = motion.mean + all * other->mean_moved;
  }
  motion.centre = (1 / total) * motion.centre;
  motion.mean = (1 / total) * motion.mean;
  std::array<Vec3, 3> square{}, product{};
  for (const auto& [other, shift, weight] : near.all()) {
    const double share = weight / total, all = share * (other->last - other->first);
    const Vec3 from = other->mean_at + shift - motion.centre;
    AddProduct(all, from, from, square);
    AddProduct(all, from, other->mean_moved - motion.mean, product);
    for (std::size_t k = 0; k < 3; ++k) {
      square[k] = square[k] + share * other->square[k];
      product[k] = product[k] + share * other->product[k];
    }
  }
  Solve(square, product, motion.slope);
  return motion;
}

}  // namespace partiemc
