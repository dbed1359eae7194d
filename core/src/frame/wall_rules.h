// The rules of walls.
#pragma once

#include <span>

#include "absl/status/status.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Checks `walls`, `wall_phases` and `wall_planes`, and that no other parameter excludes them.
/// Errors: INVALID_ARGUMENT with the Violation of the first broken rule. Cost: quadratic in the
/// points of a polygon, at most 1024.
absl::Status CheckWalls(const ReconstructionParameters& parameters);

/// Checks the walls of a surface, but not whether other parameters exclude them. `kernel_radius` is
/// in spacings, `spacing` in world units; 0 if it is absent. Errors: as above.
absl::Status CheckWallPlanes(std::span<const WallPlane> planes, double kernel_radius,
                             double spacing);

}  // namespace partiemc
