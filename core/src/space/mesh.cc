#include "space/mesh.h"

#include <algorithm>

#include "base/bits.h"

namespace partiemc::space {
namespace {

// Triangles between the crossings of a longer loop could intersect, so marching cubes uses the
// vertex in its middle.
constexpr int kLongestFlatLoop = 6;

/// Sets shell_of for the vertices of triangles, kNoIndex for others. Returns the number of shells.
std::uint32_t FindShells(std::uint32_t vertices, MeshScratch& scratch) {
  std::vector<std::uint32_t>& parent = scratch.parent;
  parent.resize(vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) parent[v] = v;
  for (const VertexTriangle& triangle : scratch.triangles) {
    for (int k = 1; k < 3; ++k) {
      const std::uint32_t a = RootOf(parent, triangle[0]), b = RootOf(parent, triangle[k]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  scratch.shell_of.assign(vertices, kNoIndex);
  for (const VertexTriangle& triangle : scratch.triangles) {
    for (const std::uint32_t v : triangle) scratch.shell_of[v] = 0;
  }
  std::uint32_t shells = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (scratch.shell_of[v] == kNoIndex) continue;
    const std::uint32_t root = RootOf(parent, v);
    scratch.shell_of[v] = root == v ? shells++ : scratch.shell_of[root];
  }
  return shells;
}

/// Turns counts at index k + 1 into offsets.
void SumUp(std::vector<std::uint32_t>& offsets) {
  for (std::size_t k = 1; k < offsets.size(); ++k) offsets[k] += offsets[k - 1];
}

void CopyPoints(const MeshInput& input, std::uint32_t shells, MeshScratch& scratch,
                Surface& surface) {
  surface.point_offsets.assign(shells + 1, 0);
  const auto vertices = static_cast<std::uint32_t>(scratch.shell_of.size());
  for (const std::uint32_t shell : scratch.shell_of) {
    if (shell != kNoIndex) ++surface.point_offsets[shell + 1];
  }
  SumUp(surface.point_offsets);
  surface.points.resize(3 * std::size_t{surface.point_offsets.back()});
  surface.normals.resize(surface.points.size());
  scratch.next.assign(surface.point_offsets.begin(), surface.point_offsets.end());
  scratch.point_of.resize(vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (scratch.shell_of[v] == kNoIndex) continue;
    const std::uint32_t point = scratch.point_of[v] = scratch.next[scratch.shell_of[v]]++;
    const Vec3& position = input.positions[v];
    const Vec3& normal = input.normals[v];
    double* const to = surface.points.data() + 3 * std::size_t{point};
    to[0] = position.x, to[1] = position.y, to[2] = position.z;
    float* const direction = surface.normals.data() + 3 * std::size_t{point};
    direction[0] = static_cast<float>(normal.x);
    direction[1] = static_cast<float>(normal.y);
    direction[2] = static_cast<float>(normal.z);
  }
}

void CopyTriangles(std::uint32_t shells, MeshScratch& scratch, Surface& surface) {
  surface.triangle_offsets.assign(shells + 1, 0);
  for (const VertexTriangle& triangle : scratch.triangles) {
    ++surface.triangle_offsets[scratch.shell_of[triangle[0]] + 1];
  }
  SumUp(surface.triangle_offsets);
  surface.triangles.resize(3 * scratch.triangles.size());
  scratch.next.assign(surface.triangle_offsets.begin(), surface.triangle_offsets.end());
  for (const VertexTriangle& triangle : scratch.triangles) {
    const std::size_t at = 3 * std::size_t{scratch.next[scratch.shell_of[triangle[0]]]++};
    for (int k = 0; k < 3; ++k) surface.triangles[at + k] = scratch.point_of[triangle[k]];
  }
}

/// Sets `surface.outer_of`, the particles of outer shells and `scratch.body_of_shell`.
void NestShells(const MeshInput& input, std::uint32_t shells, MeshScratch& scratch,
                Surface& surface) {
  const SpaceCrossings& crossings = input.crossings;
  const auto shell_of = [&](std::uint32_t v) {
    const bool is_dropped = !input.thin.empty() && !input.thin[v].IsEmpty();
    return scratch.shell_of[is_dropped ? input.thin[v].corners[0] : v];
  };
  surface.outer_of.assign(shells, kNoIndex);
  scratch.body_of_shell.assign(shells, kNoIndex);
  for (std::uint32_t brick = 0; brick < input.bricks.size(); ++brick) {
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      const std::uint32_t shell = shell_of(v);
      if (shell == kNoIndex || surface.outer_of[shell] != kNoIndex) return;
      BrickPlace node{brick, i, j, k};
      if (!input.field.IsInside(node)) {
        node = Normalise(input.bricks, brick, i + (axis == 0), j + (axis == 1), k + (axis == 2));
      }
      const std::uint32_t index = input.bodies.BodyOf(node);
      scratch.body_of_shell[shell] = index;
      const Body& body = input.bodies.bodies[index];
      const BrickPlace below = Normalise(input.bricks, body.lowest.brick, body.lowest.i,
                                         body.lowest.j, body.lowest.k - 1);
      surface.outer_of[shell] = shell_of(crossings.EdgeVertex(below, 2));
      if (surface.outer_of[shell] == shell) surface.measures[shell].particles = body.particles;
    });
  }
  for (std::uint32_t shell = 0; shell < shells; ++shell) {
    if (surface.outer_of[shell] == shell) surface.outer_of[shell] = kNoShell;
  }
}

}  // namespace

void EmitMarchingCubes(const SpaceCrossings& crossings, std::vector<VertexTriangle>& triangles) {
  triangles.clear();
  for (const ActiveCell& cell : crossings.cells) {
    const CellLoops& loops = LoopsOf(cell.corners);
    for (int loop = 0; loop < loops.loops; ++loop) {
      const int first = loops.first[loop], size = loops.first[loop + 1] - first;
      const auto vertex = [&](int step) { return crossings.StepEdgesOf(cell)[first + step]; };
      if (size > kLongestFlatLoop) {
        for (int step = 0; step < size; ++step) {
          triangles.push_back({cell.first_loop + loop, vertex(step), vertex((step + 1) % size)});
        }
        continue;
      }
      const LoopTriangles& of_loop = TrianglesOf(cell.corners, loop);
      for (int t = 0; t < of_loop.count; ++t) {
        const auto& corners = of_loop.corners[t];
        triangles.push_back({vertex(corners[0]), vertex(corners[1]), vertex(corners[2])});
      }
    }
  }
}

void MeasureShell(std::uint32_t shell, Surface& surface) {
  const Vec3 origin = Vec3At(surface.points, surface.point_offsets[shell]);
  double area = 0, volume = 0;
  Vec3 moment;
  auto cut =
      std::lower_bound(surface.cuts.begin(), surface.cuts.end(), surface.triangle_offsets[shell]);
  for (std::size_t t = surface.triangle_offsets[shell]; t < surface.triangle_offsets[shell + 1];
       ++t) {
    const Vec3 a = Vec3At(surface.points, surface.triangles[3 * t]) - origin;
    const Vec3 b = Vec3At(surface.points, surface.triangles[3 * t + 1]) - origin;
    const Vec3 c = Vec3At(surface.points, surface.triangles[3 * t + 2]) - origin;
    const double part = Dot(a, Cross(b, c)) / 6;
    if (cut != surface.cuts.end() && *cut == t) {
      ++cut;
    } else {
      area += Length(Cross(b - a, c - a)) / 2;
    }
    volume += part;
    moment = moment + (part / 4) * (a + b + c);
  }
  ShellMeasures& measures = surface.measures[shell];
  measures.area = area;
  measures.volume = volume;
  const Vec3 centroid = volume != 0 ? origin + (1 / volume) * moment : origin;
  measures.centroid_x = centroid.x;
  measures.centroid_y = centroid.y;
  measures.centroid_z = centroid.z;
}

void AssembleSurface(const MeshInput& input, MeshScratch& scratch, Surface& surface) {
  const std::uint32_t shells =
      FindShells(static_cast<std::uint32_t>(input.positions.size()), scratch);
  surface.measures.assign(shells, {});
  CopyPoints(input, shells, scratch, surface);
  CopyTriangles(shells, scratch, surface);
  NestShells(input, shells, scratch, surface);
  for (std::uint32_t shell = 0; shell < shells; ++shell) MeasureShell(shell, surface);
}

}  // namespace partiemc::space
