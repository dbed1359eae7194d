// The rules of walls.
#pragma once

#include "absl/status/status.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Checks the walls, and that nothing excludes them. Errors: INVALID_ARGUMENT with the Violation of
/// the first broken rule. Cost: quadratic in the points of a polygon, a few ms at most.
absl::Status CheckWalls(const ReconstructionParameters& parameters);

}  // namespace partiemc
