// Waits for what other threads do.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace partiemc::server {

/// Polls a condition; false if it does not become true in time.
inline bool Soon(const std::function<bool()>& is_true,
                 std::chrono::milliseconds within = std::chrono::seconds(20)) {
  const auto give_up = std::chrono::steady_clock::now() + within;
  while (!is_true()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace partiemc::server
