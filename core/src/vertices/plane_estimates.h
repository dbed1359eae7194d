// Where the particles near a virtual plane put the boundary (core/METHOD.md, "The default
// placement", 3).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "frame/scale.h"
#include "partiemc/virtual_plane_constants.h"
#include "sampler/level_set_sampler.h"
#include "sampler/query_batch.h"
#include "vertices/plane_support.h"

namespace partiemc {

/// What the particles near a plane say of it; 0 where there are none.
struct PlaneEstimate {
  /// How far outside of the plane the boundary is, in cells: by the mean distance of the particles
  /// that support it, plus half a spacing. At most the support's height either way.
  double offset = 0;
  double scatter = 0;  ///< Variance of those distances, in squared spacings.
};

/// Estimates planes of one field.
class PlaneEstimator {
 public:
  PlaneEstimator(const LevelSetSampler& field, const Scale& scale,
                 const VirtualPlaneConstants& constants);

  using Planes = PointGroup<BentPlane>;
  using Estimates = std::array<PlaneEstimate, kPointsAtOnce>;

  /// Of at most kQueriesAtOnce groups. Cost: the particles around each.
  /// Requires: field.Covers(tile, x, y) of each plane; groups and estimates are as many.
  void Estimate(std::span<const Planes> groups, std::span<Estimates> estimates) const;

 private:
  PlaneEstimate EstimateOf(const SupportSums& sums) const;

  const LevelSetSampler& field_;
  double spacing_;
  SupportShape support_;
};

}  // namespace partiemc
