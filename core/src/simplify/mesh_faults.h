// Finds where simplified shells break the guarantees S1 to S3 of surfaces (partiemc/surface.h).
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

/// The box of the points with these indices. Requires: at least one index.
Box BoxOf(std::span<const double> points, std::span<const std::uint32_t> indices);

/// Finds where a shell is not closed or not manifold: the boxes of edges that break S1 or, if there
/// are none, of points that break S2. A triangle that has a point twice breaks S1, too.
/// `triangles` are triples of indices into `points`, some of which may be unused.
/// Cost: n log n in the triangles.
void FindManifoldFaults(std::span<const double> points, std::span<const std::uint32_t> triangles,
                        std::vector<Box>& faults);

/// Whether triangles (at least one) are connected and have this number of different points.
bool IsConnected(std::span<const std::uint32_t> triangles, std::size_t points);

/// Two triangles that intersect, or one degenerate triangle (a == b). Both break S3.
struct Contact {
  std::uint32_t a, b;
  Box box;  ///< The triangles can touch only in this box.
};

/// Given triangles, those of the surface before the simplification, do not intersect each other
/// (S3). FindContacts therefore compares kNew triangles with all others, and kKept with kChanged
/// triangles.
enum TriangleKind : std::uint8_t {
  kOld = 0,      ///< Given, in a shell that was compared before.
  kNew = 1,      ///< Made from given triangles, and not compared before.
  kKept = 2,     ///< Given, in a shell that was not compared before.
  kChanged = 4,  ///< Made from given triangles, and compared before.
};

/// Finds kNew triangles that are degenerate. If there are none, finds the pairs that intersect: of
/// a kNew triangle and any other, and of a kKept and a kChanged triangle. Exact. Ignores other
/// degenerate triangles, in pairs too. `kinds`: the TriangleKind of each triangle. Requires: S1
/// (partiemc/surface.h: each edge has exactly two triangles, in opposite directions), coordinates
/// in the domain of predicates_in_space.h. Cost: n log n in the triangles if they are of similar
/// size. Takes the work from `limit` if there is one, and may throw TooMuchWork. `grid`: a buffer
/// that is reused.
void FindContacts(std::span<const double> points, std::span<const std::uint32_t> triangles,
                  std::span<const std::uint8_t> kinds, TriangleGrid& grid,
                  std::vector<Contact>& contacts, WorkLimit* limit = nullptr);

}  // namespace partiemc::simplify
