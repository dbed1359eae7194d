#include "space_vertices/roots.h"

#include <cstddef>

#include "base/parallel.h"
#include "space/point_sampler.h"
#include "space/vertices.h"

namespace partiemc::space {
namespace {

// A smaller squared gradient has no direction.
constexpr double kWeakGradient = 1e-3;
// Cells per task: enough that the cost of a sampler does not matter.
constexpr std::size_t kCellsAtOnce = 64;

class RootFinder {
 public:
  RootFinder(const SpaceBins& bins, const Scale& scale, const RootConstants& constants)
      : constants_(constants), sampler_(bins, scale) {}

  void MoveTo(const ActiveCell& cell, const Vec3& origin) {
    const auto x = static_cast<float>(cell.i), y = static_cast<float>(cell.j),
               z = static_cast<float>(cell.k);
    origin_ = origin;
    low_ = origin + Vec3{1.0 * cell.i, 1.0 * cell.j, 1.0 * cell.k};
    sampler_.MoveTo(cell.brick, {{x, y, z}, {x + 1, y + 1, z + 1}});
  }

  /// Takes one step, which ends at the sides of the cell. If the gradient is weak, position and
  /// normal stay as they are.
  void Step(Vec3& position, Vec3& normal) {
    const PointSample sample = sampler_.Sample(position - origin_);
    const double square = Dot(sample.gradient, sample.gradient);
    if (square < kWeakGradient) return;
    Vec3 step = (-sample.value / square) * sample.gradient;
    const double length = Length(step);
    if (length > constants_.newton_step) step = (constants_.newton_step / length) * step;
    const Vec3 moved = ClampedToCell(position + step, low_);
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
  Vec3 origin_, low_;
};

/// The area normal of a loop, which is used if the gradient is weak.
Vec3 NormalOfLoop(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                  const ActiveCell& cell, int loop, const std::vector<Vec3>& positions) {
  const CellLoops& loops = LoopsOf(cell.corners);
  const Vec3& centre = positions[cell.first_loop + loop];
  Vec3 sum;
  for (int step = loops.first[loop]; step < loops.first[loop + 1]; ++step) {
    const Vec3& a = positions[EdgeVertexOf(bricks, crossings, cell, loops.edge[step])];
    const Vec3& b = positions[EdgeVertexOf(bricks, crossings, cell, loops.edge[loops.Next(step)])];
    sum = sum + Cross(a - centre, b - centre);
  }
  const Vec3 normal = Normalised(sum);
  return normal == Vec3{} ? Vec3{0, 0, 1} : normal;
}

}  // namespace

void FindRoots(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
               const RootConstants& constants, std::vector<Vec3>& positions,
               std::vector<Vec3>& normals) {
  const BrickDirectory& bricks = bins.bricks;
  normals.resize(positions.size());
  ParallelForRanges(crossings.cells.size(), kCellsAtOnce, [&](std::size_t first, std::size_t last) {
    RootFinder finder(bins, scale, constants);
    for (std::size_t index = first; index < last; ++index) {
      const ActiveCell& cell = crossings.cells[index];
      const Vec3 origin = OriginOf(bricks[cell.brick]);
      finder.MoveTo(cell, origin);
      for (int loop = 0; loop < LoopsOf(cell.corners).loops; ++loop) {
        const std::uint32_t v = cell.first_loop + loop;
        normals[v] = NormalOfLoop(bricks, crossings, cell, loop, positions);
        finder.Step(positions[v], normals[v]);
      }
    }
  });
}

}  // namespace partiemc::space
