// Simplifies the shells of a surface, and keeps its guarantees S1 to S5 (core/SURFACES.md,
// "Simplification").
#pragma once

#include <cstdint>

#include "check/work_limit.h"
#include "partiemc/surface.h"

namespace partiemc::simplify {

struct SimplifyLimits {
  double error = 0;           ///< Limit of the root mean square error, in world units.
  double spacing = 1;         ///< World units.
  WorkLimit* work = nullptr;  ///< Simplify throws TooMuchWork if it exceeds this. Null: no limit.
};

/// No removed point is farther from its simplified shell than this multiple of the error.
inline constexpr double kFarthest = 2;

struct SimplifyReport {
  /// Shells that were simplified more than once because the result broke a guarantee. Includes
  /// `certified_shells`.
  std::uint32_t repeated_shells = 0;
  /// Shells that kept their given (certified) triangles, because the results broke a guarantee.
  std::uint32_t certified_shells = 0;
};

/// Removes points, and connects the others by fewer triangles. The other points keep their bits,
/// order, normals and attributes; shells keep their order. Sets area, volume and centroid, and
/// clears Surface::cuts.
/// Requires: S1 to S5, except that normals and attributes may have no values yet. S3 and S4 may
/// also be broken by rounded coordinates; the triangles there stay.
/// Deterministic for any number of threads. Allocates memory in each call. Throws Cancelled.
/// Cost: n log n in the triangles for each round; usually one to three rounds.
SimplifyReport Simplify(const SimplifyLimits& limits, Surface& surface);

}  // namespace partiemc::simplify
