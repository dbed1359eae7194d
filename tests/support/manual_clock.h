// A clock and a random source that a test controls.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <mutex>
#include <set>
#include <thread>

#include "common/clock.h"

namespace partiemc::support {

class ManualClock final : public Clock {
 public:
  TimePoint Now() const override {
    const std::lock_guard lock(mutex_);
    return now_;
  }
  std::chrono::system_clock::time_point TimeOfDay() const override {
    return std::chrono::system_clock::time_point(Now().time_since_epoch());
  }
  bool WaitUntil(CondVar& changed, Mutex& mutex, TimePoint until) const override
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    {
      const std::lock_guard lock(mutex_);
      waiting_.insert(until);
    }
    changed.WaitUntil(mutex, std::chrono::steady_clock::now() + std::chrono::milliseconds(1));
    const std::lock_guard lock(mutex_);
    waiting_.erase(waiting_.find(until));
    return now_ < until;
  }

  void Advance(std::chrono::nanoseconds time) { AdvanceTo(Now() + time); }
  void AdvanceTo(TimePoint time) {
    const std::lock_guard lock(mutex_);
    now_ = time;
  }
  /// Advances in steps of at most `step`. After each step, waits until `threads` threads have done
  /// what is due and wait for a later time.
  void Advance(std::chrono::nanoseconds time, std::chrono::nanoseconds step, std::size_t threads) {
    for (; time.count() > 0; time -= step) {
      Advance(std::min(time, step));
      while (CountWaiting() < threads) std::this_thread::yield();
    }
  }

 private:
  // Threads that wait for a later time.
  std::size_t CountWaiting() const {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(std::distance(waiting_.upper_bound(now_), waiting_.end()));
  }

  mutable std::mutex mutex_;  // Guards everything below.
  TimePoint now_{std::chrono::hours(1)};
  mutable std::multiset<TimePoint> waiting_;
};

/// Always returns the same number.
class FixedRandom final : public RandomSource {
 public:
  explicit FixedRandom(std::uint64_t number) : number_(number) {}
  std::uint64_t Next() override { return number_; }

 private:
  const std::uint64_t number_;
};

}  // namespace partiemc::support
