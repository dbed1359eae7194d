// The particle spacing, estimated from particles.
#pragma once

#include <optional>

#include "bins.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Median distance of a particle to its nearest neighbour at another position, in world units;
/// nothing without two distinct positions. Particles with no neighbour within four times that
/// median (spray, lone ones) are left out and the median is taken once more. Of large frames a
/// sample is asked, chosen by the bits of the positions: the answer does not depend on the order
/// of the particles.
/// Requires: a checked frame. Cost: n log n for the tree, a query for at most 2^14 particles or so.
std::optional<double> EstimateSpacing(const Frame& frame, Plane plane);

}  // namespace partiemc
