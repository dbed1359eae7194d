#include "space_vertices/edge_vertices.h"

#include <array>
#include <cstdint>

#include "base/parallel.h"

namespace partiemc::space {
namespace {

// Added to squared distances, in squared cells. Keeps weights finite near the edge.
constexpr double kLeastSquare = .01;

/// The vertices of the loops around a crossed edge, one in each of the four cells that share it.
std::array<std::uint32_t, 4> LoopsAround(const BrickDirectory& bricks,
                                         const SpaceCrossings& crossings, const BrickPlace& node,
                                         int axis) {
  std::array<std::uint32_t, 4> around;
  for (int k = 0; k < 4; ++k) {
    std::array<int, 3> at{node.i, node.j, node.k};
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    at[b] -= k & 1;
    at[c] -= k >> 1;
    const ActiveCell& cell =
        crossings.cells[crossings.CellAt(Normalise(bricks, node.brick, at[0], at[1], at[2]))];
    const int edge = EdgeAt(axis, (k & 1) << b | (k >> 1) << c);
    around[k] = cell.first_loop + LoopsOf(cell.corners).loop_of_edge[edge];
  }
  return around;
}

}  // namespace

void PlaceEdgesByLoops(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                       const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                       std::vector<Vec3>& normals, std::span<float> sizes) {
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      const std::array<std::uint32_t, 4> around =
          LoopsAround(bricks, crossings, {brick, i, j, k}, axis);
      std::array<double, 4> weights;
      double total = 0;
      Vec3 sum;
      for (int n = 0; n < 4; ++n) {
        const Vec3 to = positions[around[n]] - anchors[v];
        weights[n] = 1 / (Dot(to, to) + kLeastSquare);
        total += weights[n];
        sum = sum + weights[n] * normals[around[n]];
      }
      const Vec3 mean = Normalised(sum);
      const Vec3 normal = mean == Vec3{} ? normals[around[0]] : mean;
      double height = 0;
      for (int n = 0; n < 4; ++n) {
        const Vec3 to = positions[around[n]] - anchors[v];
        height += weights[n] * .5 * Dot(normal + normals[around[n]], to);
      }
      positions[v] = anchors[v] + (height / total) * normal;
      normals[v] = normal;
      if (sizes.empty()) return;
      double size = 0;
      for (int n = 0; n < 4; ++n) size += weights[n] * double{sizes[around[n]]};
      sizes[v] = static_cast<float>(size / total);
    });
  });
}

}  // namespace partiemc::space
