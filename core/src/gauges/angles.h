// Angles between an outline and a wall or the ground.
#pragma once

#include <vector>

#include "base/point.h"
#include "partiemc/result.h"

namespace partiemc {

/// A straight wall through `origin`. The body is on the left of `direction`, which has any length.
struct WallLine {
  Point origin, direction;
  double reach = 0;  ///< A circle is fitted to the outline within this distance of a contact.
};

/// The values of GaugeKind::kContact, in the order of its GaugeTraits, angles in degrees. All are
/// NaN without an outer ring; the angle and position of a contact are NaN if no circle fits there.
std::vector<double> ContactAngles(const Result& result, const WallLine& wall);

/// The values of GaugeKind::kRepose, in the order of its GaugeTraits, in degrees. Both are NaN
/// without an outer ring; one is NaN if its flank has fewer than two samples.
std::vector<double> AnglesOfRepose(const Result& result);

}  // namespace partiemc
