// Surfaces of simple shapes to test with.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "partiemc/surface.h"

namespace partiemc::support {

struct Shell {
  std::vector<Vec3> points;
  std::vector<std::uint32_t> triangles;
};

/// A box of 12 triangles, outward.
Shell BoxShell(const Vec3& low, const Vec3& high);
/// A ball of 20 * 4^rounds triangles, outward.
Shell BallShell(const Vec3& centre, double radius, int rounds);
Shell InsideOut(Shell shell);

/// Appends a shell with its normals and measures.
void AddShell(const Shell& shell, std::uint32_t outer, Surface& surface);
/// Sets the measures of the shells to what the triangles enclose.
void Measure(Surface& surface);

}  // namespace partiemc::support
