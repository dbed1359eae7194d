// Exact contact of triangles in space.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/vec3.h"

namespace partiemc {

using Triangle = std::array<std::uint32_t, 3>;  ///< Indices of points.

bool AreCollinear(const Vec3& a, const Vec3& b, const Vec3& c);

/// Whether the closed segment pq and the closed triangle abc intersect. Exact in the domain of
/// predicates_in_space.h. Requires: a, b, c are not collinear, p != q.
bool SegmentTouchesTriangle(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& abc);

/// Whether two triangles intersect anywhere except at the points and the edge that they share by
/// index. True if they share all three points. Exact in the domain of predicates_in_space.h.
/// Requires: neither triangle is degenerate.
bool TrianglesCollide(std::span<const double> points, const Triangle& first,
                      const Triangle& second);

}  // namespace partiemc
