// The particles that `partiemc load` sends.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace partiemc::client {

/// Frames of a disc of particles on a lattice of spacing 1: x0, y0, x1, y1, ... The centre of the
/// disc moves on a circle by one spacing per frame. Requires: particles > 0.
inline std::vector<std::vector<float>> LoadFrames(int particles) {
  constexpr int kFrames = 16;
  constexpr double kOrbit = kFrames / (2 * std::numbers::pi);
  const auto coordinates = 2 * static_cast<std::size_t>(particles);
  const double radius = std::sqrt(particles / std::numbers::pi) + 0.5;
  const int reach = static_cast<int>(radius) + 2;
  std::vector<std::vector<float>> frames(kFrames);
  for (int frame = 0; frame < kFrames; ++frame) {
    const double angle = 2 * std::numbers::pi * frame / kFrames;
    std::vector<float>& xy = frames[frame];
    // Adds particles row by row until there are `particles` of them. The disc may contain a few
    // more lattice points.
    for (int j = -reach; j <= reach && xy.size() < coordinates; ++j) {
      for (int i = -reach; i <= reach && xy.size() < coordinates; ++i) {
        if (i * i + j * j > radius * radius) continue;
        xy.push_back(static_cast<float>(i + kOrbit * std::cos(angle)));
        xy.push_back(static_cast<float>(j + kOrbit * std::sin(angle)));
      }
    }
  }
  return frames;
}

/// The same for a ball in space: x0, y0, z0, x1, ... Requires: particles > 0.
inline std::vector<std::vector<float>> LoadFramesInSpace(int particles) {
  constexpr int kFrames = 16;
  constexpr double kOrbit = kFrames / (2 * std::numbers::pi);
  const auto coordinates = 3 * static_cast<std::size_t>(particles);
  const double radius = std::cbrt(particles * 3 / (4 * std::numbers::pi)) + 0.5;
  const int reach = static_cast<int>(radius) + 2;
  std::vector<std::vector<float>> frames(kFrames);
  for (int frame = 0; frame < kFrames; ++frame) {
    const double angle = 2 * std::numbers::pi * frame / kFrames;
    std::vector<float>& xyz = frames[frame];
    for (int k = -reach; k <= reach; ++k) {
      for (int j = -reach; j <= reach; ++j) {
        for (int i = -reach; i <= reach && xyz.size() < coordinates; ++i) {
          if (i * i + j * j + k * k > radius * radius) continue;
          xyz.push_back(static_cast<float>(i + kOrbit * std::cos(angle)));
          xyz.push_back(static_cast<float>(j + kOrbit * std::sin(angle)));
          xyz.push_back(static_cast<float>(k));
        }
      }
    }
  }
  return frames;
}

}  // namespace partiemc::client
