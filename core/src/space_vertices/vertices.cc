#include "space_vertices/vertices.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"

namespace partiemc::space {

void PlaceOnCrossings(const BrickDirectory& bricks, const SpaceField& field,
                      const SpaceCrossings& crossings, double margin,
                      std::vector<Vec3>& positions) {
  positions.resize(crossings.VertexCount());
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    const Vec3 origin = OriginOf(bricks[brick]);
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      const double a = field.At({brick, i, j, k});
      const double b =
          field.At(Normalise(bricks, brick, i + (axis == 0), j + (axis == 1), k + (axis == 2)));
      const double t = std::clamp(a / (a - b), margin, 1 - margin);
      positions[v] =
          origin + Vec3{i + (axis == 0 ? t : 0), j + (axis == 1 ? t : 0), k + (axis == 2 ? t : 0)};
    });
  });
  ParallelFor(static_cast<std::uint32_t>(crossings.cells.size()), [&](std::uint32_t index) {
    const ActiveCell& cell = crossings.cells[index];
    const CellLoops& loops = LoopsOf(cell.corners);
    const std::uint32_t* const edges = crossings.StepEdgesOf(cell);
    for (int loop = 0; loop < loops.loops; ++loop) {
      Vec3 sum;
      const int first = loops.first[loop], last = loops.first[loop + 1];
      for (int step = first; step < last; ++step) {
        sum = sum + positions[edges[step]];
      }
      positions[cell.first_loop + loop] = (1.0 / (last - first)) * sum;
    }
  });
}

void NormalsFromTriangles(NormalWeights weights, const std::vector<Vec3>& positions,
                          const std::vector<VertexTriangle>& triangles,
                          std::vector<Vec3>& normals) {
  normals.assign(positions.size(), Vec3{});
  for (const VertexTriangle& triangle : triangles) {
    std::array<Vec3, 3> sides;  // Side k leads from corner k to the next corner.
    for (int k = 0; k < 3; ++k) {
      sides[k] = positions[triangle[(k + 1) % 3]] - positions[triangle[k]];
    }
    const Vec3 product = Cross(sides[0], positions[triangle[2]] - positions[triangle[0]]);
    for (int k = 0; k < 3; ++k) {
      Vec3 weighted = product;
      if (weights == NormalWeights::kSphere) {
        const Vec3 &next = sides[k], &last = sides[(k + 2) % 3];
        const double next_square = Dot(next, next), last_square = Dot(last, last);
        if (!(next_square > 0 && last_square > 0)) continue;
        weighted = (1 / next_square) * ((1 / last_square) * product);
      }
      normals[triangle[k]] = normals[triangle[k]] + weighted;
    }
  }
  for (Vec3& normal : normals) {
    normal = Normalised(normal);
    if (normal == Vec3{}) normal = {0, 0, 1};
  }
}

}  // namespace partiemc::space
