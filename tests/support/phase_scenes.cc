#include "support/phase_scenes.h"

#include <algorithm>

namespace partiemc::support {

Body RegionOf(const PhaseScene& scene, const PhaseScene::Region& region) {
  return {[body = scene.body.distance, own = region.distance](double x, double y) {
            return std::max(body(x, y), own(x, y));
          },
          scene.body.extent};
}

Particles Filled(const PhaseScene& scene, Random& random) {
  Particles all;
  for (const PhaseScene::Region& region : scene.regions) {
    Particles particles =
        Filled(RegionOf(scene, region), random, [](Random&, double, double) { return 1.0; });
    particles.volumes.clear();
    particles.phases.assign(particles.size(), static_cast<float>(region.phase));
    all.Add(particles);
  }
  return all;
}

}  // namespace partiemc::support
