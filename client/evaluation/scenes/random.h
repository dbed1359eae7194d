// Pseudo-random numbers that are the same on every machine and with every standard library.
#pragma once

#include <array>
#include <cstdint>

namespace partiemc::evaluation {

/// xoshiro256** (Blackman and Vigna), seeded through splitmix64. The distributions are written out
/// here, because those of the standard library differ between libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) {
    for (std::uint64_t& word : state_) {
      seed += 0x9e3779b97f4a7c15u;
      std::uint64_t z = (seed ^ (seed >> 30)) * 0xbf58476d1ce4e5b9u;
      z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
      word = z ^ (z >> 31);
    }
  }

  std::uint64_t Next() {
    const std::uint64_t result = RotateLeft(state_[1] * 5, 7) * 9;
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = RotateLeft(state_[3], 45);
    return result;
  }

  /// Uniform in [0, 1), a multiple of 2^-53.
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1p-53; }

  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }

  /// Uniform in [0, count); the bias of the modulus is below 2^-32 for any count of ours.
  std::size_t Below(std::size_t count) { return static_cast<std::size_t>(Next() % count); }

  /// Mean 0, standard deviation 1: the sum of twelve uniform numbers, hence within [-6, 6].
  double Normal() {
    double sum = -6;
    for (int k = 0; k < 12; ++k) sum += Uniform();
    return sum;
  }

 private:
  static constexpr std::uint64_t RotateLeft(std::uint64_t value, int bits) {
    return (value << bits) | (value >> (64 - bits));
  }

  std::array<std::uint64_t, 4> state_;
};

}  // namespace partiemc::evaluation
