// Interfaces for clock and random source, so that tests can replace both.
#pragma once

#include <chrono>
#include <cstdint>

#include "common/mutex.h"

namespace partiemc {

/// Thread-safe.
class Clock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  virtual ~Clock() = default;
  virtual TimePoint Now() const = 0;
  /// Time of day, comparable between machines.
  virtual std::chrono::system_clock::time_point TimeOfDay() const = 0;
  /// Waits until `changed` is notified or this clock has reached `until`; releases `mutex`
  /// meanwhile. Returns false if `until` has passed. May also return without a reason, as
  /// CondVar::WaitUntil.
  virtual bool WaitUntil(CondVar& changed, Mutex& mutex, TimePoint until) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) = 0;
};

/// Thread-safe.
class RandomSource {
 public:
  virtual ~RandomSource() = default;
  /// 64 random bits.
  virtual std::uint64_t Next() = 0;
};

/// The clock and the random source of the machine.
const Clock& SystemClock();
RandomSource& SystemRandom();

struct TimeAndChance {
  const Clock* clock = &SystemClock();
  RandomSource* random = &SystemRandom();
};

}  // namespace partiemc
