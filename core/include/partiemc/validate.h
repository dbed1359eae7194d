// Checks the guarantees of a result, for tests and `--check`.
#pragma once

#include <cstddef>

#include "absl/status/status.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"

namespace partiemc {

/// Checks R1-R4 and M1-M3 of result.h, and S1-S5 of surface.h, with exact arithmetic. M2 is checked
/// in two ways: the areas of rings and triangles agree (to 1e-9 relative), and opposite sides of
/// the triangles cancel, except along the segments of the rings. With M1 and R2 this excludes gaps
/// and overlaps. An empty mesh and Result::sections are not checked. Errors: INTERNAL with the
/// guarantee, the ring, triangle or shell, and the values. Cost: n log n in the points.
absl::Status Validate(const Result& result);

/// Checks the same as Validate(result), and M4 for Fill::kConforming and kPolygon: each side
/// belongs to exactly two triangles, or to one triangle and one segment of a ring. Rings without a
/// mesh pass only for Fill::kNone.
absl::Status Validate(const Result& result, Fill fill);

/// Counts the vertices that lie on a side of a triangle or ring between its ends; 0 if M4 holds.
/// Requires: Validate(result).ok(). Cost: n log n in the points.
std::size_t CountTJunctions(const Result& result);

}  // namespace partiemc
