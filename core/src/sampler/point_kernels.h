// The sums over particles behind LevelSetSampler::Sample, in the vectors of the processor at hand.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "crossings/crossings.h"
#include "frame/scale.h"
#include "sampler/neighbour_query.h"

namespace partiemc {

/// Up to kPointsAtOnce points, in cells relative to the tile, and the particles around them, at
/// least those within R of each.
struct PointQuery {
  NeighbourRows near;
  std::span<const Point> points;
};

/// What the field is at points (FieldSample), those of one query after those of the other.
struct PointSamples {
  /// Whole vectors of them.
  static constexpr std::size_t kCapacity =
      std::max<std::size_t>(kQueriesAtOnce * kPointsAtOnce, kRowPadding);
  using PerPoint = std::array<double, kCapacity>;

  PerPoint kernel;  ///< sum k
  PerPoint density, mean_x, mean_y, phi, phi_x, phi_y, spread, value, gradient_x, gradient_y;
};

/// Samples at the points of at most kQueriesAtOnce queries, all or none of them with weights. Terms
/// are floats, and so are their sums over up to 128 particles: off by a few 1e-7 of the sum of
/// their magnitudes. What follows from the sums is in doubles. Same bits for any processor,
/// whatever is asked at once: a query's particles within reach are dealt to sixteen partial sums by
/// their place among them, and the sixteen are added up in one order (neighbour_sums-inl.h).
void SampleAtPoints(const Scale& scale, std::span<const PointQuery> queries, PointSamples& samples);

}  // namespace partiemc
