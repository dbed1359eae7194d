// Particles and attributes for tests of memory: sizes, phases and values that vary.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "support/particles.h"
#include "support/random.h"

namespace partiemc::support {

/// Values of an attribute, for which the mesh of `greedy` has the smallest blocks.
inline std::vector<float> NoisyValues(std::size_t count) {
  Random random(9);
  std::vector<float> values(count);
  for (float& value : values) value = static_cast<float>(random.Uniform(0, 1));
  return values;
}

/// A lattice that is fine enough for the smallest of VaryingVolumes as grains.
inline constexpr double kCellOfGrains = .8;

/// Phases of particles: stripes of both, then spray of the second one.
inline std::vector<float> StripedPhases(const Particles& particles) {
  std::vector<float> phases(particles.size());
  for (std::size_t k = 0; k < phases.size(); ++k) {
    phases[k] = std::fmod(std::abs(particles.x(k)), 40) < 20 && k % 50 > 0 ? 1 : 2;
  }
  return phases;
}

/// Volumes of particles whose sizes differ by a factor of up to three.
inline std::vector<float> VaryingVolumes(std::size_t count) {
  std::vector<float> volumes(count);
  for (std::size_t k = 0; k < count; ++k) volumes[k] = .4f + static_cast<float>(k % 7) / 2;
  return volumes;
}

}  // namespace partiemc::support
