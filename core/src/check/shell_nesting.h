// Finds the orientation of the shells of a surface, and the shell around each shell.
#pragma once

#include <cstdint>
#include <vector>

#include "check/work_limit.h"
#include "partiemc/surface.h"

namespace partiemc {

/// By shell: the sign of its enclosed volume, computed exactly.
/// Requires: S1, coordinates in the domain of predicates_in_space.h. Throws Cancelled as
/// ThrowIfCancelled.
std::vector<int> OrientationsOf(const Surface& surface);

/// By shell: the innermost shell around it, or kNoShell. Exact. Requires: S1 to S3. Cost:
/// n log n in the shells and, for each shell, the triangles above and below one of its points in
/// the shells whose bounding boxes contain this point. Throws TooMuchWork if the cost exceeds
/// `limit`; null: no limit. Throws Cancelled as ThrowIfCancelled.
std::vector<std::uint32_t> ShellsAround(const Surface& surface, WorkLimit* limit = nullptr);

}  // namespace partiemc
