// Checks that triangles cover a region exactly.
#pragma once

#include <cstdint>
#include <vector>

#include "region_shapes.h"

namespace partiemc::support {

/// Expects counter-clockwise triangles whose sides cancel except for the loops. The number of
/// triangles around a point is then the winding number of the loops. Sides must match as a whole.
void ExpectCover(const Region& region, const std::vector<std::uint32_t>& triangles);

}  // namespace partiemc::support
