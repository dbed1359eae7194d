// Checks that float32 positions resolve the spacing.
#pragma once

#include "absl/status/status.h"
#include "bins/lattice.h"
#include "partiemc/doubt.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Checks float32 positions, whose smallest step grows with the distance from the origin: 1/16 at
/// 10^6. A step above 1/16 of the spacing adds kPositionsCoarse; a step above 1/4 is an error,
/// OUT_OF_RANGE (reason RESOLUTION). Does nothing for float64. Lengths in world units. Requires: a
/// checked frame and its tiles. Cost: linear in tiles; linear in particles if the tiles are far
/// from the origin.
absl::Status CheckResolution(const Frame& frame, Plane plane, const TileDirectory& tiles,
                             double cell_size, double spacing, Doubts& doubts);

/// Whether positions in space are float32 and their largest step is above 1/16 of the spacing.
bool AreCoarse(const Frame& frame, double spacing);

/// As CheckResolution, without the shortcut by tiles. Cost: linear in particles.
absl::Status CheckStep(const Frame& frame, Plane plane, double spacing, Doubts& doubts);

}  // namespace partiemc
