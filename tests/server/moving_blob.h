// A reproducible sequence of frames for tests: a jittered disc with a hole that drifts and turns
// and loses some particles.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc::server {

inline constexpr double kBlobSpacing = 0.05;

/// A frame of MovingBlob is within these.
inline constexpr FrameLimits kBlobLimits{.max_particles = 2000, .max_tiles = 1000};

inline ReconstructionParameters BlobParameters() {
  ReconstructionParameters parameters;
  parameters.spacing = kBlobSpacing;
  return parameters;
}

/// Interleaved x, y of frame `index` of sequence `seed`; about 1,200 particles.
inline std::vector<double> MovingBlob(unsigned seed, std::uint64_t index) {
  // Not a standard distribution: its values differ between libraries.
  std::mt19937_64 random(seed * 1000003ull + index);
  const auto jitter = [&] {
    return (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5) * 0.4 * kBlobSpacing;
  };
  const double drift = 0.03 * static_cast<double>(index);
  std::vector<double> positions;
  for (int row = -20; row <= 20; ++row) {
    for (int column = -20; column <= 20; ++column) {
      const double x = column * kBlobSpacing, y = row * kBlobSpacing;
      const double from_hole = (x - 0.3) * (x - 0.3) + y * y;
      if (x * x + y * y > 1 || from_hole < 0.06) continue;
      const double fling = random() % 100 == 0 ? 1.5 : 1.0;
      positions.push_back(fling * x + drift + jitter());
      positions.push_back(fling * y - 0.5 * drift + jitter());
    }
  }
  return positions;
}

}  // namespace partiemc::server
