// The kernels of LevelSetSampler::Sample, in vectors.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "crossings/crossings.h"
#include "frame/scale.h"
#include "sampler/neighbour_query.h"

namespace partiemc {

/// Up to kPointsAtOnce points, in cells relative to the tile, and at least the particles within R
/// of each.
struct PointQuery {
  NeighbourRows near;
  std::span<const Point> points;
};

/// Samples (FieldSample) at the points of the queries, in order.
struct PointSamples {
  /// A multiple of the vector size.
  static constexpr std::size_t kCapacity =
      std::max<std::size_t>(kQueriesAtOnce * kPointsAtOnce, kRowPadding);
  using PerPoint = std::array<double, kCapacity>;

  PerPoint kernel;  ///< sum k
  PerPoint density, mean_x, mean_y, phi, phi_x, phi_y, spread, value, gradient_x, gradient_y;
  PerPoint size;  ///< The local size, in spacings.
};

/// Samples the points of at most kQueriesAtOnce queries. Requires: all queries have weights, or no
/// query has; the same of sizes. Terms, and their sums over up to 128 particles, are floats with an
/// error of a few 1e-7 of the sum of their magnitudes; all else is computed in doubles. The bits
/// depend neither on the processor nor on the other queries. The particles of a query go to sixteen
/// partial sums by their index, and these sums are added in one order (neighbour_sums-inl.h).
void SampleAtPoints(const Scale& scale, std::span<const PointQuery> queries, PointSamples& samples);

}  // namespace partiemc
