// Which shell is turned which way, and which lies in which.
#pragma once

#include <cstdint>
#include <vector>

#include "partiemc/surface.h"

namespace partiemc {

/// Per shell: the sign of its enclosed volume, exactly.
/// Requires: S1, coordinates in the domain of predicates_in_space.h.
std::vector<int> OrientationsOf(const Surface& surface);

/// Per shell: the innermost shell around it, or kNoShell. Exact. Requires: S1 to S3.
/// Cost: shells times the triangles above and below one of their points.
std::vector<std::uint32_t> ShellsAround(const Surface& surface);

}  // namespace partiemc
