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

/// Sets `far` to the indices of the points of `range` that are farther than `distance` from all
/// triangles. `triangles` are triples of indices in `range`. `cell` is about the length of edges
/// before the simplification. Cost: for each triangle, the points near its box; n log n in the
/// points. Takes the work from `limit` if there is one, and may throw TooMuchWork.
void FindFarPoints(std::span<const double> points, PointRange range,
                   std::span<const std::uint32_t> triangles, double distance, double cell,
                   std::vector<std::uint32_t>& far, WorkLimit* limit = nullptr);

}  // namespace partiemc::simplify
