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
  WorkLimit* work = nullptr;  ///< Exceeding it throws TooMuchWork. Null: no limit.
};

/// No removed point is farther from the simplified shell than this multiple of the error.
inline constexpr double kFarthest = 2;

struct SimplifyReport {
  std::uint32_t repeated_shells = 0;   ///< Shells that were simplified more than once.
  std::uint32_t certified_shells = 0;  ///< Shells that kept their triangles.
};

/// Removes points, and connects the others by fewer triangles. The other points keep their bits,
/// their order, normals and attributes; shells keep their order. Sets area, volume and centroid.
/// No triangle is a cut afterwards.
/// Requires: S1 to S5, except that normals and attributes may have no values yet. If coordinates
/// are rounded, S3 and S4 may be broken: then the triangles there stay.
/// Deterministic for any number of threads. Allocates memory in each call.
/// Cost: n log n in the triangles for each round; usually one to three rounds.
SimplifyReport Simplify(const SimplifyLimits& limits, Surface& surface);

}  // namespace partiemc::simplify
