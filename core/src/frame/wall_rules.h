// The rules of walls.
#pragma once

#include <optional>
#include <span>

#include "absl/status/status.h"
#include "frame/frame_view.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Checks `walls`, `wall_phases` and `wall_planes`, and that no other parameter excludes them.
/// Errors: INVALID_ARGUMENT with the Violation of the first broken rule. Cost: quadratic in the
/// points of a polygon, at most 1024.
absl::Status CheckWalls(const ReconstructionParameters& parameters);

/// Checks the walls of a surface, but not whether other parameters exclude walls. `kernel_radius`
/// is in spacings. `spacing` is in world units, 0 if unknown: then walls of an axis may be closer
/// than a kernel radius. Errors: INVALID_ARGUMENT with the Violation of the first broken rule.
absl::Status CheckWallPlanes(std::span<const WallPlane> planes, double kernel_radius,
                             double spacing);

/// Checks the walls of an outline in a periodic box. `axes`: of the plane of the particles. Errors:
/// INVALID_ARGUMENT for endless lines that are not their own images, and for tanks.
absl::Status CheckWallsInBox(std::span<const Wall> walls, const PeriodicBox& box, const Axes& axes);

/// Checks that no plane of a surface lies across a periodic axis. Errors: INVALID_ARGUMENT.
absl::Status CheckAxesOfWalls(std::span<const WallPlane> planes,
                              const std::optional<PeriodicBox>& box);

}  // namespace partiemc
