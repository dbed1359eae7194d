// Sums velocities independently of their order.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "partiemc/frame.h"

namespace partiemc {

/// Converts velocities to integers, whose sums are exact. The unit is a power of two, such that the
/// sum over all particles fits into 62 bits.
class VelocityUnits {
 public:
  explicit VelocityUnits(const Frame& frame) {
    float largest = 0;
    for (const float value : frame.velocities) largest = std::max(largest, std::abs(value));
    if (largest == 0) return;
    int exponent = 0;
    std::frexp(largest, &exponent);  // frexp and ldexp only change exponents: they are exact.
    per_unit_ =
        std::ldexp(1.0, 62 - static_cast<int>(std::bit_width(frame.ParticleCount())) - exponent);
  }

  std::int64_t Of(float value) const { return static_cast<std::int64_t>(value * per_unit_); }
  double Mean(std::int64_t sum, std::uint64_t count) const {
    return static_cast<double>(sum) / static_cast<double>(count) / per_unit_;
  }

 private:
  double per_unit_ = 1;
};

}  // namespace partiemc
