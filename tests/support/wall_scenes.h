// Walls and bodies of fluid at them, whose outline is known.
#pragma once

#include <vector>

#include "partiemc/parameters.h"
#include "support/particles.h"
#include "support/random.h"

namespace partiemc::support {

/// One to three walls near the particles: endless lines, tanks and obstacles of 3 to 60 points.
std::vector<Wall> RandomWalls(Random& random, const Particles& particles);

/// A regular polygon. `turn`: of its first point. Counter-clockwise if `is_tank`.
Wall PolygonWall(double x, double y, double radius, int count, double turn, bool is_tank);

/// Signed distance to a wall, negative in its solid, by a sum over all of its lines.
double HeightAbove(const Wall& wall, double x, double y);

}  // namespace partiemc::support
