// Finds where simplified shells break the guarantees of surfaces (partiemc/surface.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "check/triangle_grid.h"
#include "check/work_limit.h"

namespace partiemc::simplify {

struct Box {
  Vec3 low, high;
};

/// The box of the points with these indices, of which there is one at least.
Box BoxOf(std::span<const double> points, std::span<const std::uint32_t> indices);

/// Finds where a shell is not closed or not manifold: boxes of the edges that break S1 or, if there
/// are none, the points that break S2. A triangle that has a point twice breaks S1, too.
/// `triangles` are triples of indices into `points`, which may hold unused points.
/// Cost: n log n in the triangles.
void FindManifoldFaults(std::span<const double> points, std::span<const std::uint32_t> triangles,
                        std::vector<Box>& faults);

/// Whether the triangles of a shell without faults are one connected surface with this number of
/// points.
bool IsConnected(std::span<const std::uint32_t> triangles, std::size_t points);

/// Two triangles that break S3, or one that is degenerate (a == b).
struct Contact {
  std::uint32_t a, b;
  Box box;  ///< Holds where they touch.
};

/// FindContacts compares a kNew triangle with all others, and a kKept with a kChanged one.
enum TriangleKind : std::uint8_t {
  kOld = 0,
  kNew = 1,
  kKept = 2,     ///< New here, but has not changed since the last guarantee.
  kChanged = 4,  ///< Has changed since the last guarantee, but was compared.
};

/// Finds kNew triangles that are degenerate or, if there are none, pairs of triangles that
/// intersect. Exact. Skips other degenerate triangles.
/// Requires: S1, coordinates in the domain of predicates_in_space.h. `kinds` are TriangleKind.
/// Cost: n log n in the triangles if they are of similar size; counts in `limit`, if it is given.
/// `grid`: a warm buffer.
void FindContacts(std::span<const double> points, std::span<const std::uint32_t> triangles,
                  std::span<const std::uint8_t> kinds, TriangleGrid& grid,
                  std::vector<Contact>& contacts, WorkLimit* limit = nullptr);

}  // namespace partiemc::simplify
