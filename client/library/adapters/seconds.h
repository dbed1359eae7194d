// Converts times in seconds, as C, Python and flags give them.
#pragma once

#include <algorithm>
#include <chrono>

namespace partiemc::client {

/// `seconds`, rounded up to milliseconds; 0 if negative or NaN. The limit, 1e9 seconds, is about
/// thirty years, which clocks can still add.
inline std::chrono::milliseconds ToMilliseconds(double seconds) {
  constexpr double kLongest = 1e9;
  if (!(seconds > 0)) return std::chrono::milliseconds(0);
  return std::chrono::ceil<std::chrono::milliseconds>(
      std::chrono::duration<double>(std::min(seconds, kLongest)));
}

}  // namespace partiemc::client
