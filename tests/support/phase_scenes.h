// Bodies of several phases, whose interfaces are known.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "support/particles.h"
#include "support/random.h"
#include "support/sized_scenes.h"

namespace partiemc::support {

/// A body that is divided into regions. A region lies where its distance is negative.
struct PhaseScene {
  Body body;
  struct Region {
    std::int32_t phase;
    std::function<double(double x, double y)> distance;
  };
  std::vector<Region> regions;
};

/// A region of a body as a body.
Body RegionOf(const PhaseScene& scene, const PhaseScene::Region& region);

/// Particles of spacing 1 that fill each region up to half a spacing from its boundary, with the
/// region's phase. Without volumes.
Particles Filled(const PhaseScene& scene, Random& random);

}  // namespace partiemc::support
