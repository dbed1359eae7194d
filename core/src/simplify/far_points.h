// Finds the points of a surface that are far from a simplification of it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "check/work_limit.h"

namespace partiemc::simplify {

struct PointRange {
  std::uint32_t first, last;  ///< [first, last).
};

/// Finds the points of `range` that are farther than `distance` from all triangles. `cell` is a
/// length about as long as the edges of the surface. Corners of triangles are not far.
/// Cost: for each triangle, the points near its box; n log n in the points. Counts in `limit`, if
/// it is given.
void FindFarPoints(std::span<const double> points, PointRange range,
                   std::span<const std::uint32_t> triangles, double distance, double cell,
                   std::vector<std::uint32_t>& far, WorkLimit* limit = nullptr);

}  // namespace partiemc::simplify
