#include "space_vertices/qef.h"

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/parallel.h"
#include "space/level_set.h"
#include "space/point_sampler.h"
#include "space_vertices/vertices.h"

namespace partiemc::space {
namespace {

// The weight of the mean of the crossings.
constexpr double kRegularisation = .05;

/// The solution of A x = b. Requires: A is positive definite.
Vec3 Solve(const Symmetric& a, const Vec3& b) {
  const Vec3 x{a.xx, a.xy, a.xz}, y{a.xy, a.yy, a.yz}, z{a.xz, a.yz, a.zz};
  const Vec3 yz = Cross(y, z), zx = Cross(z, x), xy = Cross(x, y);
  const double inverse = 1 / Dot(x, yz);
  return inverse * (b.x * yz + b.y * zx + b.z * xy);
}

/// Sets the normal of each crossing: the direction of the gradient, or of the edge if that is 0.
void FindEdgeNormals(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
                     const std::vector<Vec3>& positions, std::vector<Vec3>& normals) {
  ParallelFor(static_cast<std::uint32_t>(bins.bricks.size()), [&](std::uint32_t brick) {
    PointSampler sampler(bins, scale);
    const Vec3 origin = OriginOf(bins.bricks[brick]);
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      const auto x = static_cast<float>(i), y = static_cast<float>(j), z = static_cast<float>(k);
      sampler.MoveTo(brick, {{x, y, z},
                             {x + static_cast<float>(axis == 0), y + static_cast<float>(axis == 1),
                              z + static_cast<float>(axis == 2)}});
      normals[v] = Normalised(sampler.Sample(positions[v] - origin).gradient);
      if (normals[v] != Vec3{}) return;
      const Vec3 lower{x, y, z};
      const Vec3 along{axis == 0 ? 1.0 : 0, axis == 1 ? 1.0 : 0, axis == 2 ? 1.0 : 0};
      const bool rises = sampler.Sample(lower).value <= sampler.Sample(lower + along).value;
      normals[v] = (rises ? 1.0 : -1.0) * along;
    });
  });
}

void AddSquare(const Vec3& n, Symmetric& a) {
  a.xx += n.x * n.x;
  a.xy += n.x * n.y;
  a.xz += n.x * n.z;
  a.yy += n.y * n.y;
  a.yz += n.y * n.z;
  a.zz += n.z * n.z;
}

}  // namespace

Vec3 LeastSquarePoint(std::span<const TangentPlane> planes, const Vec3& mean) {
  Symmetric a{kRegularisation, 0, 0, kRegularisation, 0, kRegularisation};
  Vec3 b;
  for (const TangentPlane& plane : planes) {
    AddSquare(plane.normal, a);
    b = b + Dot(plane.normal, plane.point - mean) * plane.normal;
  }
  return mean + Solve(a, b);
}

void PlaceByQef(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
                std::vector<Vec3>& positions, std::vector<Vec3>& normals) {
  const BrickDirectory& bricks = bins.bricks;
  normals.resize(positions.size());
  FindEdgeNormals(bins, scale, crossings, positions, normals);
  ParallelFor(static_cast<std::uint32_t>(crossings.cells.size()), [&](std::uint32_t index) {
    const ActiveCell& cell = crossings.cells[index];
    const CellLoops& loops = LoopsOf(cell.corners);
    const Vec3 low = OriginOf(bricks[cell.brick]) + Vec3{1.0 * cell.i, 1.0 * cell.j, 1.0 * cell.k};
    for (int loop = 0; loop < loops.loops; ++loop) {
      const std::uint32_t vertex = cell.first_loop + loop;
      const Vec3 mean = positions[vertex];
      std::array<TangentPlane, kMostCrossings> planes;
      std::size_t count = 0;
      Vec3 sum;
      for (int step = loops.first[loop]; step < loops.first[loop + 1]; ++step) {
        const std::uint32_t v = EdgeVertexOf(bricks, crossings, cell, loops.edge[step]);
        planes[count++] = {positions[v], normals[v]};
        sum = sum + normals[v];
      }
      positions[vertex] =
          ClampedToCell(LeastSquarePoint(std::span(planes).first(count), mean), low);
      const Vec3 normal = Normalised(sum);
      normals[vertex] = normal == Vec3{} ? Vec3{0, 0, 1} : normal;
    }
  });
}

}  // namespace partiemc::space
