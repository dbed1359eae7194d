// The rules of walls.
#pragma once

#include <span>

#include "absl/status/status.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Checks the walls, and that nothing excludes them. Errors: INVALID_ARGUMENT with the Violation of
/// the first broken rule. Cost: quadratic in the points of a polygon, of which there are at most
/// 1024.
absl::Status CheckWalls(const ReconstructionParameters& parameters);

/// Checks the walls of a surface, but not what excludes them. `spacing`: 0 if it is absent.
/// `kernel_radius` is in spacings. Errors: as above.
absl::Status CheckWallPlanes(std::span<const WallPlane> planes, double kernel_radius,
                             double spacing);

}  // namespace partiemc
