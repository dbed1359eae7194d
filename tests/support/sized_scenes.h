// Bodies of particles of different sizes, whose boundary is known.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "support/particles.h"
#include "support/random.h"

namespace partiemc::support {

/// A body by its signed distance: negative inside.
struct Body {
  std::function<double(double x, double y)> distance;
  double extent;  ///< The body lies in [-extent, extent] along each axis.
};

Body DiscBody(double radius);
/// A square with rounded corners.
Body SquareBody(double half_side, double corner);
/// A body with a wavy outline around a circle.
Body WavyBody(double radius, int waves, double height);

/// Draws the size of a particle at (x, y); 0: there is none. Zones of large particles need fewer.
using DrawSize = std::function<double(Random& random, double x, double y)>;

/// Fills a body with particles until their areas h_i^2 make up the area of the body. Moves them
/// apart until pairs are about (h_i + h_j) / 2 apart, and the outermost particles half their size
/// from the boundary. Volumes are h_i^2.
Particles Filled(const Body& body, Random& random, const DrawSize& draw);

/// A random scene whose sizes are from `smallest` to `ratio` times as much.
Particles RandomSizes(std::uint64_t seed, double smallest, double ratio);

/// Moves particles at random. The standard deviation along each axis is `noise` times their size.
Particles Shaken(Particles particles, Random& random, double noise);

}  // namespace partiemc::support
