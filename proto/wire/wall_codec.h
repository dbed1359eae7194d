// Encodes and decodes walls (v1::Wall).
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/parameters.h"
#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::wire {

/// Copies the walls of a message, after it has counted their points. The core's Validate checks the
/// coordinates. Errors: INVALID_ARGUMENT with a Violation for more than kMaxWallPoints points
/// together, and for more than kMaxWallPoints / 2 walls.
absl::StatusOr<std::vector<Wall>> DecodeWalls(const v1::ReconstructionParameters& message);

/// Adds walls to `message`, which has none.
void EncodeWalls(const std::vector<Wall>& walls, v1::ReconstructionParameters& message);

/// Copies the walls of a surface. The core's Validate checks them.
/// Errors: INVALID_ARGUMENT with a Violation for more than kMaxWallPlanes walls, or another axis
/// than 0, 1, 2.
absl::StatusOr<std::vector<WallPlane>> DecodeWallPlanes(
    const v1::ReconstructionParameters& message);

/// Adds walls of a surface to `message`, which has none.
void EncodeWallPlanes(const std::vector<WallPlane>& planes, v1::ReconstructionParameters& message);

}  // namespace partiemc::wire
