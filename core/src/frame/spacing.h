// Estimates the particle spacing from the particles.
#pragma once

#include <optional>
#include <vector>

#include "frame/frame_view.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Warm buffers of EstimateSpacing.
struct SpacingScratch {
  std::vector<Point> positions;  ///< Distinct positions, as a k-d tree.
  std::vector<Point> asked;      ///< The sample of `positions`.
  std::vector<double> distances, weights;
};

struct SpacingEstimate {
  double spacing;  ///< World units.
  bool is_agreed;  ///< Particles agree on the spacing (EstimateSpacing).
};

/// Estimates the spacing of a frame in world units: 1 / sqrt(number density) inside filled bodies.
/// Empty if there are no two distinct positions. core/METHOD.md, "How the paper is read", 10, has
/// the method and its constants.
/// - The density is the mean of kernel sums at points that particles surround. Edges, noise and
///   random thinning do not change this mean, while noise and thinning shrink the distances to the
///   nearest neighbour.
/// - If bodies are too thin to surround a point, the result is the median distance to the nearest
///   neighbour. The median is also the result on lattices, where it is exact. Particles more than
///   four medians from their neighbours (spray) are left out.
/// - `is_agreed`: of the particles that are not spray, enough are surrounded (near_ring.h) at
///   distances within a factor of two of their median. If the estimate is then below half this
///   median, as for pairs of particles, the estimate is repeated from the median.
/// Large frames are sampled by a hash of the positions, so the order of the particles does not
/// matter.
/// Requires: a checked frame. Cost: n log n for the tree, and queries for about 2^14 particles.
/// Allocates nothing once `scratch` is warm.
std::optional<SpacingEstimate> EstimateSpacing(const Frame& frame, Plane plane,
                                               SpacingScratch& scratch);

}  // namespace partiemc
