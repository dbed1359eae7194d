// Level sets written by hand on two by two tiles.
#pragma once

#include <cmath>
#include <initializer_list>
#include <utility>

#include "bins/lattice.h"
#include "partiemc/parameters.h"
#include "support/particles.h"

namespace partiemc::support {

/// Distance to a circle, negative inside.
inline double Circle(double x, double y, double cx, double cy, double radius) {
  return std::hypot(x - cx, y - cy) - radius;
}

inline Particles At(std::initializer_list<std::pair<double, double>> positions) {
  Particles particles;
  for (const auto& [x, y] : positions) particles.Add(x, y);
  return particles;
}

inline ReconstructionParameters Plain(bool clean) {
  return {.placement = Placement::kMarchingSquares, .spacing = 1.0, .clean = clean};
}

/// The tiles of these level sets.
inline constexpr TileCoordinate kLow{0, 0}, kHigh{1, 1};

}  // namespace partiemc::support
