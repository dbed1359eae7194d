#include "space/roots.h"

#include <algorithm>
#include <cstddef>

#include "base/parallel.h"
#include "space/point_sampler.h"
#include "space/vertices.h"

namespace partiemc::space {
namespace {

// A smaller squared gradient has no direction.
constexpr double kWeakGradient = 1e-3;
// Cells per task: hides the cost of a sampler.
constexpr std::size_t kCellsAtOnce = 64;

class RootFinder {
 public:
  RootFinder(const SpaceBins& bins, const Scale& scale, const RootConstants& constants)
      : constants_(constants), sampler_(bins, scale) {}

  void MoveTo(const ActiveCell& cell, const Vec3& origin) {
    const auto reach = static_cast<float>(constants_.newton_step);
    const auto x = static_cast<float>(cell.i), y = static_cast<float>(cell.j),
               z = static_cast<float>(cell.k);
    origin_ = origin;
    sampler_.MoveTo(cell.brick, {{x - reach, y - reach, z - reach},
                                 {x + 1 + reach, y + 1 + reach, z + 1 + reach}});
  }

  /// Takes one step; `limit` keeps the new point where it may be. The normal stays as it is if the
  /// gradient is weak.
  template <typename Limit>
  void Step(Limit limit, Vec3& position, Vec3& normal) {
    const PointSample sample = sampler_.Sample(position - origin_);
    const double square = Dot(sample.gradient, sample.gradient);
    if (square < kWeakGradient) return;
    Vec3 step = (-sample.value / square) * sample.gradient;
    const double length = Length(step);
    if (length > constants_.newton_step) step = (constants_.newton_step / length) * step;
    const Vec3 moved = limit(position + step);
    Vec3 gradient = sample.gradient;
    if (Length(moved - position) > constants_.long_step) {
      const PointSample again = sampler_.Sample(moved - origin_);
      if (Dot(again.gradient, again.gradient) >= kWeakGradient) gradient = again.gradient;
    }
    position = moved;
    normal = Normalised(gradient);
  }

 private:
  const RootConstants& constants_;
  PointSampler sampler_;
  Vec3 origin_;
};

/// The area normal of a loop: the direction if the gradient is weak.
Vec3 NormalOfLoop(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                  const ActiveCell& cell, int loop, const std::vector<Vec3>& positions) {
  const CellLoops& loops = LoopsOf(cell.corners);
  const Vec3& centre = positions[cell.first_loop + loop];
  Vec3 sum;
  for (int step = loops.first[loop]; step < loops.first[loop + 1]; ++step) {
    const Vec3& a = positions[EdgeVertexOf(bricks, crossings, cell, loops.edge[step])];
    const Vec3& b =
        positions[EdgeVertexOf(bricks, crossings, cell, loops.edge[loops.Next(step)])];
    sum = sum + Cross(a - centre, b - centre);
  }
  const Vec3 normal = Normalised(sum);
  return normal == Vec3{} ? Vec3{0, 0, 1} : normal;
}

Vec3 Clamped(const Vec3& point, const Vec3& low) {
  const auto clamp = [](double value, double from) {
    return std::clamp(value, from + kAnchorMargin, from + 1 - kAnchorMargin);
  };
  return {clamp(point.x, low.x), clamp(point.y, low.y), clamp(point.z, low.z)};
}

}  // namespace

void FindRoots(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
               const RootConstants& constants, std::vector<Vec3>& positions,
               std::vector<Vec3>& normals) {
  const BrickDirectory& bricks = bins.bricks;
  normals.resize(positions.size());
  // Before any vertex moves.
  ParallelFor(static_cast<std::uint32_t>(crossings.cells.size()), [&](std::uint32_t index) {
    const ActiveCell& cell = crossings.cells[index];
    for (int loop = 0; loop < LoopsOf(cell.corners).loops; ++loop) {
      normals[cell.first_loop + loop] = NormalOfLoop(bricks, crossings, cell, loop, positions);
    }
  });
  ParallelForRanges(
      crossings.cells.size(), kCellsAtOnce, [&](std::size_t first, std::size_t last) {
        RootFinder finder(bins, scale, constants);
        for (std::size_t index = first; index < last; ++index) {
          const ActiveCell& cell = crossings.cells[index];
          const Vec3 origin = OriginOf(bricks[cell.brick]);
          const Vec3 low = origin + Vec3{1.0 * cell.i, 1.0 * cell.j, 1.0 * cell.k};
          finder.MoveTo(cell, origin);
          for (int loop = 0; loop < LoopsOf(cell.corners).loops; ++loop) {
            const std::uint32_t v = cell.first_loop + loop;
            finder.Step([&](const Vec3& to) { return Clamped(to, low); }, positions[v],
                        normals[v]);
          }
          // The edges at the cell's lowest node are the cell's.
          for (int axis = 0; axis < 3; ++axis) {
            if (((cell.corners ^ cell.corners >> (1 << axis)) & 1) == 0) continue;
            const std::uint32_t v =
                crossings.EdgeVertex({cell.brick, cell.i, cell.j, cell.k}, axis);
            const double outward = (cell.corners & 1) != 0 ? 1 : -1;
            normals[v] = {axis == 0 ? outward : 0, axis == 1 ? outward : 0,
                          axis == 2 ? outward : 0};
            finder.Step([](const Vec3& to) { return to; }, positions[v], normals[v]);
          }
        }
      });
}

}  // namespace partiemc::space
