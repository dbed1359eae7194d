// The sums and formulas of LevelSetSampler::Sample, in SIMD vectors with run-time dispatch.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "crossings/crossings.h"
#include "frame/scale.h"
#include "sampler/neighbour_query.h"

namespace partiemc {

/// Up to kPointsAtOnce points, in cells relative to a tile, and the particles within R of them.
struct PointQuery {
  NeighbourRows near;
  std::span<const Point> points;
};

/// Samples at the points of all queries, in order. Names as in FieldSample.
struct PointSamples {
  /// A multiple of the vector size.
  static constexpr std::size_t kCapacity =
      std::max<std::size_t>(kQueriesAtOnce * kPointsAtOnce, kRowPadding);
  using PerPoint = std::array<double, kCapacity>;

  PerPoint kernel;  ///< sum k
  PerPoint density, mean_x, mean_y, phi, phi_x, phi_y, spread, value, gradient_x, gradient_y;
  PerPoint size;  ///< The local size, in spacings.
};

/// Samples the points of 1 to kQueriesAtOnce queries. Requires: all queries have weights, or none
/// has; all have sizes, or none has. Terms, and their sums over up to 128 particles, are floats
/// with an error of a few 1e-7 of the sum of their magnitudes. All else is computed in doubles. The
/// bits depend neither on the processor nor on the other queries (neighbour_sums-inl.h).
void SampleAtPoints(const Scale& scale, std::span<const PointQuery> queries, PointSamples& samples);

}  // namespace partiemc
