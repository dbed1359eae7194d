// Walls and bodies of fluid at them, whose outline is known.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "partiemc/parameters.h"
#include "support/particles.h"
#include "support/random.h"

namespace partiemc::support {

/// One to three walls near the particles: endless lines, tanks and obstacles of 3 to 60 points.
std::vector<Wall> RandomWalls(Random& random, const Particles& particles);

/// A regular polygon. `turn`: of its first point. Counter-clockwise if `is_tank`.
Wall PolygonWall(double x, double y, double radius, int count, double turn, bool is_tank);

/// A frame of reference along a wall at a random place: a = along it, w = the height above it.
struct WallFrame {
  double x, y, ux, uy;

  explicit WallFrame(Random& random) {
    const double tilt = random.Uniform(0, 2 * std::numbers::pi);
    x = random.Uniform(-3, 3);
    y = random.Uniform(-3, 3);
    ux = std::cos(tilt);
    uy = std::sin(tilt);
  }
  double A(double px, double py) const { return (px - x) * ux + (py - y) * uy; }
  double W(double px, double py) const { return (py - y) * ux - (px - x) * uy; }
  void Add(double a, double w, Particles& to) const {
    to.Add(x + a * ux - w * uy, y + a * uy + w * ux);
  }
  Wall Floor() const { return {{x, y, x + ux, y + uy}}; }
};

/// Signed distance to a wall, negative in its solid, by a sum over all of its lines.
double HeightAbove(const Wall& wall, double x, double y);

}  // namespace partiemc::support
