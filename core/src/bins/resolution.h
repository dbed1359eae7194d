// Whether positions are fine enough for the spacing.
#pragma once

#include "absl/status/status.h"
#include "bins/lattice.h"
#include "partiemc/doubt.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Coordinates that come as float32 have a smallest step, which grows with their distance from the
/// origin: at 10^6 it is 1/16. Steps of more than 1/16 of the spacing are a doubt, of more than 1/4
/// an error. Positions of float64 never are.
/// Errors: OUT_OF_RANGE (reason RESOLUTION). Requires: a checked frame and its tiles.
/// Cost: a look at each tile; at each particle only where that gives cause.
absl::Status CheckResolution(const Frame& frame, Plane plane, const TileDirectory& tiles,
                             double cell_size, double spacing, Doubts& doubts);

}  // namespace partiemc
