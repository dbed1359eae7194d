// Weighted means over windows of loops: normals, bends and planes.
//
// In the window of loop i, loop j has the weight area_j B(d, s_i reach), where d = |c_j - c_i|,
// B(d, r) = max(0, 1 - d^2 / r^2)^2, and s_i is the local size. `kAtEdges` multiplies this weight
// by max(0, n_i . n_j)^32, where cosines below 1/8 count as 0. Then loops beyond a sharp edge do
// not count. Lengths are in cells.
#pragma once

#include <cstddef>
#include <span>

#include "base/vec3.h"
#include "space_vertices/loop_windows.h"

namespace partiemc::space {

/// The input of the filters. Arrays are by loop.
struct LoopSurface {
  const LoopWindows& windows;
  std::span<const Vec3> centres;  ///< c: the vertex of the loop.
  std::span<const double> areas;  ///< Areas of the triangles around the centres.
  std::span<const float> sizes;   ///< Local sizes s, in spacings; empty for equal sizes.

  double SizeOf(std::size_t loop) const { return sizes.empty() ? 1 : double{sizes[loop]}; }
};

enum class Stop { kNowhere, kAtEdges };

/// Sets `smooth` to the normalised weighted means of the normals. Where the mean is 0, the normal
/// stays. Requires: `smooth` does not overlap `normals`.
void SmoothNormals(const LoopSurface& surface, std::span<const Vec3> normals, double reach,
                   Stop stop, std::span<Vec3> smooth);

/// Sets `bends` to the sum of the principal curvatures, from the turn of the normals within
/// `reach` s_i; 0 where nothing is near. Positive where the surface is convex. Clamped to
/// +-`limit` / s_i. s_i is SizeOf(i), a ratio. `reach` and 1 / `limit` are lengths in cells.
void FindBends(const LoopSurface& surface, std::span<const Vec3> normals, double reach,
               double limit, std::span<double> bends);

/// Sets `smooth` to the centres, moved to the mean of the near planes: along n_i by the mean of
/// (n_i + n_j) / 2 . (c_j - c_i) + base_j, weighted as for kAtEdges. A sphere with bases 0 stays
/// unchanged, because the mean normal of two of its points is perpendicular to their chord.
void SmoothOnPlanes(const LoopSurface& surface, std::span<const Vec3> normals,
                    std::span<const double> bases, double reach, std::span<Vec3> smooth);

}  // namespace partiemc::space
