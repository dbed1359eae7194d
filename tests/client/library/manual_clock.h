// A clock and a random source that a test controls.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "client/library/clock.h"

namespace partiemc::client {

class ManualClock final : public Clock {
 public:
  TimePoint Now() const override { return TimePoint(TimePoint::duration(now_)); }
  void Advance(std::chrono::nanoseconds time) { now_ += time.count(); }
  void AdvanceTo(TimePoint time) { now_ = time.time_since_epoch().count(); }

 private:
  std::atomic<TimePoint::rep> now_ = 0;
};

/// Always returns the same number.
class FixedRandom final : public RandomSource {
 public:
  explicit FixedRandom(std::uint64_t number) : number_(number) {}
  std::uint64_t Next() override { return number_; }

 private:
  const std::uint64_t number_;
};

}  // namespace partiemc::client
