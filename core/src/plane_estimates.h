// Where the particles near a virtual plane put the boundary (core/METHOD.md, "The default
// placement", 3).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "plane_support.h"
#include "point_field.h"
#include "point_groups.h"
#include "scale.h"

namespace partiemc {

/// How far outside of a plane the boundary is, in cells; each at most 0.8 spacings either way. 0
/// where there is nothing to tell it by.
struct PlaneEstimates {
  double support = 0;  ///< By the outermost particles' mean distance to it, plus half a spacing.
  double strip = 0;    ///< By the particles' volume in a strip below it.
};

/// Estimates planes of one field.
class PlaneEstimator {
 public:
  PlaneEstimator(const PointField& field, const Scale& scale);

  using Planes = PointGroup<BentPlane>;
  using Estimates = std::array<PlaneEstimates, kPointsAtOnce>;

  /// Of at most kQueriesAtOnce groups. Cost: the particles within three spacings of each.
  /// Requires: field.Covers(tile, x, y) of each plane; groups and estimates are as many.
  void Estimate(std::span<const Planes> groups, std::span<Estimates> estimates) const;

 private:
  PlaneEstimates EstimatesOf(const SupportSums& sums) const;

  const PointField& field_;
  const Scale& scale_;
  SupportShape support_;
  StripShape strip_;
};

}  // namespace partiemc
