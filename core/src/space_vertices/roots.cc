#include "space_vertices/roots.h"

#include <cstdint>
#include <span>

#include "base/parallel.h"
#include "space/brick_blocks.h"
#include "space/point_sampler.h"
#include "space_vertices/vertices.h"

namespace partiemc::space {
namespace {

// Gradients with a smaller square are weak: their directions are not used.
constexpr double kWeakGradient = 1e-3;

// Cells along a block.
constexpr int kBlock = 2;

class RootFinder {
 public:
  RootFinder(const SpaceBins& bins, const Scale& scale, const NearRows& rows,
             const RootConstants& constants)
      : constants_(constants), sampler_(bins, scale, &rows) {}

  /// Moves to a block of 2 x 2 x 2 cells.
  void MoveTo(std::uint32_t brick, const Vec3& origin, int i, int j, int k) {
    const auto x = static_cast<float>(i), y = static_cast<float>(j), z = static_cast<float>(k);
    origin_ = origin;
    sampler_.MoveTo(brick, {{x, y, z}, {x + kBlock, y + kBlock, z + kBlock}});
  }

  /// Takes one step of FindRoots in the cell with the lowest node `low`. If the gradient is weak,
  /// position and normal stay as they are. Returns the local size.
  double Step(const Vec3& low, Vec3& position, Vec3& normal) {
    const PointSample sample = sampler_.Sample(position - origin_);
    const double square = Dot(sample.gradient, sample.gradient);
    if (square < kWeakGradient) return sample.size;
    Vec3 step = (-sample.value / square) * sample.gradient;
    const double length = Length(step);
    if (length > constants_.newton_step) step = (constants_.newton_step / length) * step;
    const Vec3 moved = ClampedToCell(position + step, low);
    Vec3 gradient = sample.gradient;
    if (Length(moved - position) > constants_.long_step) {
      const PointSample again = sampler_.Sample(moved - origin_);
      if (Dot(again.gradient, again.gradient) >= kWeakGradient) gradient = again.gradient;
    }
    position = moved;
    normal = Normalised(gradient);
    return sample.size;
  }

 private:
  const RootConstants& constants_;
  PointSampler sampler_;
  Vec3 origin_;
};

/// The normalised sum of the area normals of the triangles of a loop.
Vec3 NormalOfLoop(const SpaceCrossings& crossings, const ActiveCell& cell, int loop,
                  const std::vector<Vec3>& positions) {
  const CellLoops& loops = LoopsOf(cell.corners);
  const std::uint32_t* const edges = crossings.StepEdgesOf(cell);
  const Vec3& centre = positions[cell.first_loop + loop];
  Vec3 sum;
  for (int step = loops.first[loop]; step < loops.first[loop + 1]; ++step) {
    const Vec3& a = positions[edges[step]];
    const Vec3& b = positions[edges[loops.Next(step)]];
    sum = sum + Cross(a - centre, b - centre);
  }
  const Vec3 normal = Normalised(sum);
  return normal == Vec3{} ? Vec3{0, 0, 1} : normal;
}

}  // namespace

void FindRoots(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
               const RootConstants& constants, std::vector<Vec3>& positions,
               std::vector<Vec3>& normals, std::span<float> sizes) {
  const BrickDirectory& bricks = bins.bricks;
  normals.resize(positions.size());
  const NearRows rows(kBlock, static_cast<float>(scale.kernel_radius));
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    RootFinder finder(bins, scale, rows, constants);
    const Vec3 origin = OriginOf(bricks[brick]);
    ForEachInBlocks(
        crossings.bricks[brick].active,
        [&](int i, int j, int k) { finder.MoveTo(brick, origin, i, j, k); },
        [&](int i, int j, int k) {
          const ActiveCell& cell = crossings.cells[crossings.CellAt({brick, i, j, k})];
          const Vec3 low = origin + Vec3{1.0 * i, 1.0 * j, 1.0 * k};
          for (int loop = 0; loop < LoopsOf(cell.corners).loops; ++loop) {
            const std::uint32_t v = cell.first_loop + loop;
            normals[v] = NormalOfLoop(crossings, cell, loop, positions);
            const double size = finder.Step(low, positions[v], normals[v]);
            if (!sizes.empty()) sizes[v] = static_cast<float>(size);
          }
        });
  });
}

}  // namespace partiemc::space
