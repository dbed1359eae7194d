#include "space_vertices/thinning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/parallel.h"
#include "base/predicates_in_space.h"

namespace partiemc::space {
namespace {

/// Returns the distance of the origin from the segment a b.
double DistanceToSegment(const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double square = Dot(along, along);
  const double t = square > 0 ? std::clamp(-Dot(a, along) / square, 0.0, 1.0) : 0;
  return Length(a + t * along);
}

/// Returns the distance of the origin from the triangle a b c.
double DistanceToTriangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = Cross(b - a, c - a);
  const bool is_above =
      Dot(normal, Cross(a, b)) > 0 && Dot(normal, Cross(b, c)) > 0 && Dot(normal, Cross(c, a)) > 0;
  if (is_above) return std::abs(Dot(normal, a)) / Length(normal);
  return std::min({DistanceToSegment(a, b), DistanceToSegment(b, c), DistanceToSegment(c, a)});
}

/// A crossed edge with the four cells around it.
struct EdgeStar {
  std::array<std::uint32_t, 4> loops;  ///< Vertices in the cells, counter-clockwise.
  Vec3 low, high;                      ///< The moved positions of the nodes at its ends.
  bool is_low_inside;
};

class Thinner {
 public:
  Thinner(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
          const Certificate& certificate, const std::vector<Vec3>& positions)
      : bricks_(bricks),
        crossings_(crossings),
        cell_size_(cell_size),
        certificate_(certificate),
        positions_(positions) {}

  /// Whether all four quads at a crossed edge are cut across cells. If so, sets `star`.
  bool FindStar(const BrickPlace& node, int axis, EdgeStar& star) const;

  /// Returns the nearest valid quad that can replace a vertex, if it is at most `distance` cells
  /// from the vertex; otherwise an empty one.
  ThinQuad FindQuad(std::uint32_t vertex, const EdgeStar& star, double distance) const;

 private:
  const BrickDirectory& bricks_;
  const SpaceCrossings& crossings_;
  const double cell_size_;
  const Certificate& certificate_;
  const std::vector<Vec3>& positions_;
};

bool Thinner::FindStar(const BrickPlace& node, int axis, EdgeStar& star) const {
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  std::array<std::uint32_t, 4> cells;
  for (int k = 0; k < 4; ++k) {
    std::array<int, 3> at{node.i, node.j, node.k};
    at[b] -= static_cast<int>(k == 1 || k == 2);
    at[c] -= static_cast<int>(k >= 2);
    cells[k] = crossings_.CellAt(Normalise(bricks_, node.brick, at[0], at[1], at[2]));
    star.loops[k] = crossings_.cells[cells[k]].first_loop;
  }
  const auto is_across = [&](std::uint32_t cell, int face_axis) {
    return certificate_.modes[cell][face_axis] == QuadMode::kAcrossCells;
  };
  if (!is_across(cells[1], b) || !is_across(cells[2], b) || !is_across(cells[2], c) ||
      !is_across(cells[3], c)) {
    return false;
  }
  std::array<int, 3> at{node.i, node.j, node.k};
  star.low = NodeAt(bricks_, certificate_.nodes, cell_size_, node.brick, at);
  ++at[axis];
  star.high = NodeAt(bricks_, certificate_.nodes, cell_size_, node.brick, at);
  star.is_low_inside = (crossings_.cells[cells[0]].corners & 1) != 0;
  return true;
}

ThinQuad Thinner::FindQuad(std::uint32_t vertex, const EdgeStar& star, double distance) const {
  ThinQuad best;
  double least = distance;
  for (int first = 0; first < 2; ++first) {
    std::array<std::uint32_t, 4> corners;
    std::array<Vec3, 4> at, from_vertex;
    for (int k = 0; k < 4; ++k) {
      corners[k] = star.loops[(first + k) & 3];
      at[k] = positions_[corners[k]];
      from_vertex[k] = (1 / cell_size_) * (at[k] - positions_[vertex]);
    }
    const double here =
        std::min(DistanceToTriangle(from_vertex[0], from_vertex[1], from_vertex[2]),
                 DistanceToTriangle(from_vertex[0], from_vertex[2], from_vertex[3]));
    if (!(here <= least) || (here == least && !best.IsEmpty())) continue;
    const auto separates = [&](const Vec3& p, const Vec3& q, const Vec3& r) {
      return SideOfPlane(p, q, r, star.low) < 0 && SideOfPlane(p, q, r, star.high) > 0;
    };
    if (!separates(at[0], at[1], at[2]) || !separates(at[0], at[2], at[3])) continue;
    least = here;
    best.corners = corners;
    if (!star.is_low_inside) std::swap(best.corners[1], best.corners[3]);
  }
  return best;
}

}  // namespace

void FindThinEdges(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                   const Certificate& certificate, const std::vector<Vec3>& positions,
                   double distance, std::vector<ThinQuad>& thin, std::span<const float> sizes) {
  thin.assign(crossings.edge_count, {});
  if (!(distance > 0)) return;
  const Thinner thinner(bricks, crossings, cell_size, certificate, positions);
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      EdgeStar star;
      if (!thinner.FindStar({brick, i, j, k}, axis, star)) return;
      thin[v] = thinner.FindQuad(v, star, sizes.empty() ? distance : distance * double{sizes[v]});
    });
  });
}

void EmitQuads(const BrickDirectory& bricks, const SpaceCrossings& crossings,
               const Certificate& certificate, std::span<const ThinQuad> thin,
               std::vector<VertexTriangle>& triangles) {
  triangles.clear();
  for (std::uint32_t index = 0; index < crossings.cells.size(); ++index) {
    const ActiveCell& cell = crossings.cells[index];
    const CellLoops& loops = LoopsOf(cell.corners);
    const std::uint32_t* const edges = crossings.StepEdgesOf(cell);
    for (int step = 0; step < loops.Steps(); ++step) {
      const int face = loops.face[step];
      if ((face & 1) == 0) continue;
      const ActiveCell& other = crossings.cells[CellAcross(bricks, crossings, cell, face)];
      const int edge = EdgeAcross(loops.edge[step], face);
      const std::uint32_t from = edges[step], to = edges[loops.Next(step)];
      const std::uint32_t low = cell.first_loop + loops.loop_of[step];
      const std::uint32_t high = other.first_loop + LoopsOf(other.corners).loop_of_edge[edge];
      if (certificate.modes[index][face / 2] == QuadMode::kAlongFace) {
        triangles.push_back({low, from, to});
        triangles.push_back({high, to, from});
        continue;
      }
      if (thin[from].IsEmpty()) triangles.push_back({low, from, high});
      if (thin[to].IsEmpty()) triangles.push_back({low, high, to});
    }
  }
  for (const ThinQuad& quad : thin) {
    if (quad.IsEmpty()) continue;
    const auto& [a, b, c, d] = quad.corners;
    triangles.push_back({a, b, c});
    triangles.push_back({a, c, d});
  }
}

}  // namespace partiemc::space
