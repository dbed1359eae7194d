// A stream of surfaces: two balls of particles in space that merge.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc::server {

struct SpaceParticles {
  std::vector<double> positions;
  std::vector<std::uint64_t> ids;

  /// A view.
  Frame AsFrame(double time) const {
    return {
        .positions = std::span<const double>(positions), .components = 3, .ids = ids, .time = time};
  }
};

/// Two balls of 257 particles. They touch in about the tenth frame and are one body afterwards.
inline SpaceParticles MergingBalls(std::uint64_t index) {
  SpaceParticles particles;
  const double shift = .3 * static_cast<double>(index);
  for (int x = -4; x <= 20; ++x) {
    const int from_centre = x < 8 ? x : x - 16;
    for (int y = -4; y <= 4; ++y) {
      for (int z = -4; z <= 4; ++z) {
        if (from_centre * from_centre + y * y + z * z > 16) continue;
        // Shaken: no two neighbours have the same distance.
        const double shake = .2 * std::sin(1.7 * x + 2.3 * y + 3.1 * z);
        particles.positions.insert(particles.positions.end(),
                                   {x + shake + (x < 8 ? shift : -shift), y - shake, 1.0 * z});
        particles.ids.push_back(particles.ids.size());
      }
    }
  }
  return particles;
}

/// Surfaces, and the outline on the plane z = 0.
inline ReconstructionParameters MergingBallsParameters() {
  ReconstructionParameters parameters{.output = Output::kSurface, .spacing = 1};
  parameters.sections = {{.slice = SlicePlane{}}};
  return parameters;
}

}  // namespace partiemc::server
