// Whether triangles cover a region exactly.
#pragma once

#include <cstdint>
#include <vector>

#include "region_shapes.h"

namespace partiemc::testing {

/// Expects counter-clockwise triangles whose sides cancel but for the loops: together they cover
/// each point as often as the loops wind round it. Sides have to match whole.
void ExpectCover(const Region& region, const std::vector<std::uint32_t>& triangles);

}  // namespace partiemc::testing
