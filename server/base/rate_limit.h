// So many of a kind in a second, and the others counted.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <utility>

namespace partiemc::server {

/// Safe from any thread.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;

  explicit RateLimit(std::uint32_t per_second) : per_second_(per_second) {}

  /// Whether one more is let through at `now`; seconds begin with the first that comes after one.
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

  /// How many were held back since the last time that this was asked.
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
