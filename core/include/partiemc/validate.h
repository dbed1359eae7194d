// Every guarantee of a result, checked.
#pragma once

#include <cstddef>

#include "absl/status/status.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"

namespace partiemc {

/// Checks guarantees R1-R4 and M1-M3 of result.h with exact arithmetic; M2 by areas, equal to
/// 1e-9 relative, and by sides: those of the triangles cancel but for the segments of the rings,
/// which together with M1 and R2 leaves no room for a gap or an overlap.
/// Errors: INTERNAL, naming the guarantee, the ring or triangle, and what was found.
/// Cost: n log n in the points. Made for tests and for `--check`, not for the hot path.
absl::Status Validate(const Result& result);

/// The same for a result that is known to be filled by `fill`, and M4 where that promises it:
/// exactly two triangles share each side, or one triangle and a segment of a ring.
absl::Status Validate(const Result& result, Fill fill);

/// The number of vertices that lie inside a side of a triangle or ring: 0 where M4 is promised.
/// Requires: Validate(result).ok(). Cost: n log n in the points.
std::size_t CountTJunctions(const Result& result);

}  // namespace partiemc
