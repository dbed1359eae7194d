// The particles that `partiemc load` sends.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace partiemc::client {

/// Returns 16 frames of `particles` particles on a lattice of spacing 1. They form a disc (x0, y0,
/// x1, ...), or with 3 `dimensions` a ball (x0, y0, z0, x1, ...). Its centre moves on a circle by
/// one spacing per frame. Requires: particles > 0.
inline std::vector<std::vector<float>> LoadFrames(int particles, std::size_t dimensions = 2) {
  constexpr int kFrames = 16;
  constexpr double kOrbit = kFrames / (2 * std::numbers::pi);
  const bool in_space = dimensions == 3;
  const auto coordinates = dimensions * static_cast<std::size_t>(particles);
  const double radius = (in_space ? std::cbrt(particles * 3 / (4 * std::numbers::pi))
                                  : std::sqrt(particles / std::numbers::pi)) +
                        0.5;
  const int reach = static_cast<int>(radius) + 2;
  const int reach_z = in_space ? reach : 0;
  std::vector<std::vector<float>> frames(kFrames);
  for (int frame = 0; frame < kFrames; ++frame) {
    const double angle = 2 * std::numbers::pi * frame / kFrames;
    std::vector<float>& positions = frames[frame];
    // Adds particles row by row until there are `particles` of them. The disc or ball may contain a
    // few more lattice points.
    for (int k = -reach_z; k <= reach_z; ++k) {
      for (int j = -reach; j <= reach; ++j) {
        for (int i = -reach; i <= reach && positions.size() < coordinates; ++i) {
          if (i * i + j * j + k * k > radius * radius) continue;
          positions.push_back(static_cast<float>(i + kOrbit * std::cos(angle)));
          positions.push_back(static_cast<float>(j + kOrbit * std::sin(angle)));
          if (in_space) positions.push_back(static_cast<float>(k));
        }
      }
    }
  }
  return frames;
}

}  // namespace partiemc::client
