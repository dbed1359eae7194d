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

/// The values of GaugeKind::kContact, in the order of its GaugeTraits. NaN without an outer ring.
std::vector<double> ContactAngles(const Result& result, const WallLine& wall);

/// The values of GaugeKind::kRepose, in the order of its GaugeTraits. NaN without an outer ring.
std::vector<double> AnglesOfRepose(const Result& result);

}  // namespace partiemc
