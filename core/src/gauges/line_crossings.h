// Crossings of the rings with a straight line.
#pragma once

#include <vector>

#include "base/point.h"
#include "partiemc/result.h"

namespace partiemc {

/// The parameters t of the points origin + t direction where the rings cross the line, ascending. A
/// vertex on the line counts as left of the line, so the number of crossings is even. Requires:
/// `direction` is not 0.
/// Cost: linear in the points, n log n in the crossings.
std::vector<double> LineCrossings(const Rings& rings, const Point& origin, const Point& direction);

}  // namespace partiemc
