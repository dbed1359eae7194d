// Packings of discs that touch but do not overlap, and measures of outlines around them.
#pragma once

#include <cstddef>
#include <functional>

#include "partiemc/result.h"
#include "support/particles.h"
#include "support/random.h"

namespace partiemc::support {

/// Draws the diameter of a grain.
using DrawDiameter = std::function<double(Random& random)>;

/// A round heap: each new grain touches two others, as near to the origin as it fits. Volumes are
/// squared diameters.
Particles GrainHeap(Random& random, std::size_t count, const DrawDiameter& draw);
/// A column on a flat floor, 12 to 13 units wide: each new grain touches two others or the floor,
/// as low as it fits.
Particles GrainColumn(Random& random, std::size_t count, const DrawDiameter& draw);
/// Lone grains: gaps are at least as wide as the larger of both grains.
Particles GrainSpray(Random& random, std::size_t count, const DrawDiameter& draw);

/// An outline against the discs of its grains.
struct GrainFigures {
  double worst_cut = 0;  ///< Deepest point of a ring in a grain, in the grain's diameters.
  /// Largest distance of a ring from the nearest grain, in the mean diameter of the two nearest.
  double farthest = 0;
  std::size_t lost = 0;  ///< Grains whose centre is outside.
};
GrainFigures MeasureGrains(const Rings& rings, const Particles& grains);

/// The diameter of a grain.
double DiameterOf(const Particles& grains, std::size_t k);

/// Whether a point is inside the rings.
bool IsInside(const Rings& rings, double x, double y);

}  // namespace partiemc::support
