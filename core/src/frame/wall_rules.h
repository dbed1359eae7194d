// The rules of walls.
#pragma once

#include "absl/status/status.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Checks the walls, and that nothing excludes them. Errors: INVALID_ARGUMENT with the Violation of
/// the first broken rule. Cost: quadratic in the points of a polygon, of which there are at most
/// 1024.
absl::Status CheckWalls(const ReconstructionParameters& parameters);

}  // namespace partiemc
