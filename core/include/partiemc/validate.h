// Every guarantee of a result, checked.
#pragma once

#include "absl/status/status.h"
#include "partiemc/result.h"

namespace partiemc {

/// Checks guarantees R1-R4 and M1-M3 of result.h with exact arithmetic; M2 by areas, equal to
/// 1e-9 relative, and by sides: those of the triangles cancel but for the segments of the rings,
/// which together with M1 and R2 leaves no room for a gap or an overlap.
/// Errors: INTERNAL, naming the guarantee, the ring or triangle, and what was found.
/// Cost: n log n in the points. Made for tests and for `--check`, not for the hot path.
absl::Status Validate(const Result& result);

}  // namespace partiemc
