#include "client/library/backoff.h"

#include <algorithm>

namespace partiemc::client {

std::chrono::milliseconds Backoff::NextPause() {
  const std::size_t attempt = attempts_++;
  if (attempt < address_count_) return std::chrono::milliseconds(0);
  // Only the first attempt of a round over the addresses has a pause.
  if (attempt % address_count_ != 0) return std::chrono::milliseconds(0);
  constexpr std::size_t kMostDoublings = 30;
  const std::size_t doublings = std::min(attempt / address_count_ - 1, kMostDoublings);
  const auto pause = std::min<std::chrono::milliseconds::rep>(
      policy_.first_pause.count() << doublings, policy_.longest_pause.count());
  // One step of a linear congruential generator (Knuth's MMIX). Its upper bits are the random ones.
  random_ = random_ * 6364136223846793005u + 1442695040888963407u;
  const double left_out = static_cast<double>(random_ >> 32) * 0x1p-32 / 2;
  return std::chrono::milliseconds(
      static_cast<std::chrono::milliseconds::rep>(static_cast<double>(pause) * (1 - left_out)));
}

}  // namespace partiemc::client
