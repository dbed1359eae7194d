// Where the particles near a virtual plane put the boundary (core/METHOD.md, "The default
// placement", 3).
#pragma once

#include <array>
#include <cstdint>

#include "plane_support.h"
#include "point_field.h"
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

  /// `plane` in cells relative to `tile`. Cost: the particles within three spacings.
  /// Requires: field.Covers(tile, plane.x, plane.y).
  PlaneEstimates Estimate(std::uint32_t tile, const BentPlane& plane) const;

  /// Two neighbours at once, which costs less than one after the other. Either may be in no tile,
  /// kNoTile: nothing tells where it belongs.
  std::array<PlaneEstimates, 2> EstimateTwo(const std::array<std::uint32_t, 2>& tiles,
                                            const std::array<BentPlane, 2>& planes) const;

 private:
  SupportQuery QueryAt(std::uint32_t tile, const BentPlane& plane) const;
  PlaneEstimates EstimatesOf(const SupportSums& sums) const;

  const PointField& field_;
  const Scale& scale_;
  SupportShape support_;
  StripShape strip_;
};

}  // namespace partiemc
