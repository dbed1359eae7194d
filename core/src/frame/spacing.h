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
  std::vector<Point> asked;      ///< The sample.
  std::vector<double> distances, weights;
};

struct SpacingEstimate {
  double spacing;  ///< World units.
  bool is_agreed;  ///< Enough particles are surrounded and agree.
};

/// Estimates the spacing of a frame in world units: 1 / sqrt(number density) inside filled bodies.
/// Empty without two distinct positions. core/METHOD.md, "How the paper is read", 10, has the
/// method and its constants.
/// - The density is the mean of kernel sums at points that particles surround, so edges, noise and
/// random thinning do not matter. Distances to the nearest neighbour shrink under noise and
/// thinning.
/// - The result is the median distance to the nearest neighbour if bodies are too thin to surround
/// a point, and on lattices, where it is exact. Particles more than four medians from their
/// neighbours (spray) are left out.
/// - `is_agreed`: enough of the other particles are surrounded (near_ring.h) at distances within a
/// factor of two of each other. If nearest neighbours are much closer than the ring around, as if
/// every particle were doubled, the ring decides.
/// Large frames are sampled by the bits of the positions, so the order of the particles does not
/// matter.
/// Requires: a checked frame. Cost: n log n for the tree, and queries for about 2^14 particles.
/// Allocates nothing once `scratch` is warm.
std::optional<SpacingEstimate> EstimateSpacing(const Frame& frame, Plane plane,
                                               SpacingScratch& scratch);

}  // namespace partiemc
