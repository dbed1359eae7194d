// Allows a number of events per second and counts the others.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <utility>

namespace partiemc::server {

/// Thread-safe.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;

  explicit RateLimit(std::uint32_t per_second) : per_second_(per_second) {}

  /// Counts one event at `now`; true if it is within the limit. Each second begins with the first
  /// event after the previous one.
  bool Allow(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
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

  /// Returns the number of events over the limit since the last call.
  std::uint64_t TakeHeldBack() {
    const std::lock_guard lock(mutex_);
    return std::exchange(held_back_, 0);
  }
  std::uint64_t held_back_in_all() const {
    const std::lock_guard lock(mutex_);
    return held_back_in_all_;
  }

 private:
  const std::uint32_t per_second_;
  mutable std::mutex mutex_;
  Clock::time_point begin_;
  std::uint32_t passed_ = 0;
  std::uint64_t held_back_ = 0, held_back_in_all_ = 0;
};

}  // namespace partiemc::server
