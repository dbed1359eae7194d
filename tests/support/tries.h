// The number of random inputs of a test, and where they start.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace partiemc::support {

/// Returns `usual`, or a tenth of it with sanitizers, which make each try 10 to 20 times as slow.
/// The environment variable PARTIEMC_TRIES multiplies it: PARTIEMC_TRIES=10 tries ten times as
/// much.
template <typename Count>
Count Tries(Count usual) {
#ifdef PARTIEMC_SANITIZED
  constexpr double kUsualShare = .1;
#else
  constexpr double kUsualShare = 1;
#endif
  const char* const factor = std::getenv("PARTIEMC_TRIES");
  const double share = kUsualShare * (factor == nullptr ? 1 : std::strtod(factor, nullptr));
  return std::max(Count(1), static_cast<Count>(static_cast<double>(usual) * share + .5));
}

/// The seed of the first input: the environment variable PARTIEMC_SEED, 1 without it.
inline std::uint64_t FirstSeed() {
  const char* const seed = std::getenv("PARTIEMC_SEED");
  return seed == nullptr ? 1 : std::strtoull(seed, nullptr, 10);
}

}  // namespace partiemc::support
