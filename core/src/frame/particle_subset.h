// Some of the particles of a frame.
#pragma once

#include <cstdint>
#include <span>

namespace partiemc {

/// Particles with one label.
struct ParticleSubset {
  std::span<const std::uint8_t> labels = {};  ///< By particle of the frame; empty: all particles.
  std::uint8_t label = 0;

  bool Contains(std::uint32_t particle) const {
    return labels.empty() || labels[particle] == label;
  }
};

}  // namespace partiemc
