// The sums over particles behind LevelSetSampler::Sample, in the vectors of the processor at hand.
#pragma once

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

/// What the field is at the points of a query (FieldSample).
struct PointSamples {
  using PerPoint = std::array<double, kPointsAtOnce>;

  PerPoint kernel;  ///< sum k
  PerPoint density, mean_x, mean_y, phi, phi_x, phi_y, spread, value, gradient_x, gradient_y;
};

/// Samples at the points of a query; what is told of more points than it has means nothing. Terms
/// are floats, and so are their sums over up to 128 particles: off by a few 1e-7 of the sum of
/// their magnitudes. What follows from the sums is in doubles. Same bits for any processor: a
/// query's particles within reach are dealt to sixteen partial sums by their place among them, and
/// the sixteen are added up in one order (neighbour_sums-inl.h).
void SampleAtPoints(const Scale& scale, const PointQuery& query, PointSamples& samples);

}  // namespace partiemc
