// Where the particles near a virtual plane put the boundary (core/METHOD.md, "The default
// placement", 3).
#pragma once

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

/// `plane` in cells relative to `tile`. Cost: the particles within three spacings.
/// Requires: field.Covers(tile, plane.x, plane.y).
PlaneEstimates EstimatePlane(const PointField& field, const Scale& scale, std::uint32_t tile,
                             const BentPlane& plane);

}  // namespace partiemc
