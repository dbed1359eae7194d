// Interfaces for clock and random source, so that tests can replace both.
#pragma once

#include <chrono>
#include <cstdint>

namespace partiemc::client {

/// Thread-safe.
class Clock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  virtual ~Clock() = default;
  virtual TimePoint Now() const = 0;
};

/// Thread-safe.
class RandomSource {
 public:
  virtual ~RandomSource() = default;
  virtual std::uint64_t Next() = 0;
};

/// The clock and the random source of the machine.
Clock& SystemClock();
RandomSource& SystemRandom();

struct TimeAndChance {
  const Clock* clock = &SystemClock();
  RandomSource* random = &SystemRandom();
};

}  // namespace partiemc::client
