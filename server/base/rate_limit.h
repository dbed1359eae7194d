// Permits a limited number of events per second, and counts the events that exceed the limit.
#pragma once

#include <chrono>
#include <cstdint>
#include <utility>

#include "common/mutex.h"

namespace partiemc::server {

/// Thread-safe.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;

  explicit RateLimit(std::uint32_t per_second) : per_second_(per_second) {}

  /// Counts an event at `now`. Returns whether it is within the limit of the current second. A
  /// second begins with the first event after the previous second has passed.
  bool Allow(Clock::time_point now) {
    const MutexLock lock(mutex_);
    if (now - begin_ >= std::chrono::seconds(1)) {
      begin_ = now;
      passed_ = 0;
    }
    if (passed_ < per_second_) {
      ++passed_;
      return true;
    }
    ++held_back_;
    ++held_back_in_all_;
    return false;
  }

  /// Returns the number of events that exceeded the limit since the last call of this function.
  std::uint64_t TakeHeldBack() {
    const MutexLock lock(mutex_);
    return std::exchange(held_back_, 0);
  }
  std::uint64_t held_back_in_all() const {
    const MutexLock lock(mutex_);
    return held_back_in_all_;
  }

 private:
  const std::uint32_t per_second_;
  mutable Mutex mutex_;
  Clock::time_point begin_ ABSL_GUARDED_BY(mutex_);
  std::uint32_t passed_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t held_back_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t held_back_in_all_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace partiemc::server
