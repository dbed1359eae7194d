// Particles with ids and noise, for tests of the noise filter.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "partiemc/parameters.h"
#include "partiemc/state.h"
#include "support/particles.h"
#include "support/random.h"

namespace partiemc::support {

inline ReconstructionParameters Filtering(double weight = .5) {
  return {.spacing = 1.0, .noise_filter = weight};
}

/// A normally distributed number: the sum of twelve uniform ones.
inline double Normal(Random& random) {
  double sum = -6;
  for (int k = 0; k < 12; ++k) sum += random.Unit();
  return sum;
}

inline Particles WithIds(Particles particles) {
  particles.ids.clear();
  for (std::size_t k = 0; k < particles.size(); ++k) particles.ids.push_back(7 * k);
  return particles;
}

inline Particles Shaken(Particles particles, double deviation, Random& random) {
  for (double& at : particles.xy) at += deviation * Normal(random);
  return particles;
}

/// The largest filtered minus given coordinate, in cells.
inline double LargestOffset(const State& state) {
  double largest = 0;
  for (const float offset : state.noise.offsets) {
    largest = std::max(largest, std::abs(static_cast<double>(offset)));
  }
  return largest;
}

}  // namespace partiemc::support
