// Checks that float32 positions resolve the spacing.
#pragma once

#include "absl/status/status.h"
#include "bins/lattice.h"
#include "partiemc/doubt.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// float32 coordinates have a smallest step that grows with their distance from the origin: 1/16 at
/// 10^6. A step above 1/16 of the spacing is a doubt, above 1/4 an error. Does nothing for float64.
/// Errors: OUT_OF_RANGE (reason RESOLUTION). Requires: a checked frame and its tiles. Cost: linear
/// in tiles; linear in particles if the tiles are suspicious.
absl::Status CheckResolution(const Frame& frame, Plane plane, const TileDirectory& tiles,
                             double cell_size, double spacing, Doubts& doubts);

}  // namespace partiemc
