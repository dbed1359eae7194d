// The particle spacing, estimated from particles.
#pragma once

#include <optional>
#include <vector>

#include "frame/frame_view.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// Warm buffers of EstimateSpacing.
struct SpacingScratch {
  std::vector<Point> positions;  ///< Distinct, as a k-d tree.
  std::vector<Point> asked;      ///< Those asked for their neighbours.
  std::vector<double> distances, weights;
};

struct SpacingEstimate {
  double spacing;  ///< World units.
  bool is_agreed;  ///< Enough of the positions are surrounded and tell the same.
};

/// The side of the square that each particle stands for where bodies are filled: 1 / sqrt(density),
/// in world units; nothing without two distinct positions. The density is the mean of kernel sums
/// at points that particles surround, so that neither edges nor noise nor a random thinning of the
/// particles matter; distances to the nearest neighbour shrink under both (core/METHOD.md, "How the
/// paper is read", 11). Where bodies are too thin to surround a point, and on lattices, which it
/// tells exactly, it is the median distance to the nearest neighbour at another position; particles
/// with none within four times that median (spray, lone ones) are left out and it is taken once
/// more. Of large frames a sample is asked, chosen by the bits of the positions: the answer does
/// not depend on the order of the particles.
///
/// It is agreed where, of the particles that are not left out, enough have neighbours around them
/// (near_ring.h) at distances within a factor of two of each other. Where the nearest neighbours
/// are far nearer than those around, as if every particle were doubled, those around count instead.
/// Requires: a checked frame. Cost: n log n for the tree, a few queries for at most 2^14 particles
/// or so. Allocates nothing once `scratch` is warm.
std::optional<SpacingEstimate> EstimateSpacing(const Frame& frame, Plane plane,
                                               SpacingScratch& scratch);

}  // namespace partiemc
