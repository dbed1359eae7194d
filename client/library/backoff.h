// When to try again to reach a server.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "partiemc/client/stream.h"

namespace partiemc::client {

/// One loss of a connection: how long to wait before each attempt to go on.
class Backoff {
 public:
  /// `random` tells this client's pauses from those of others.
  Backoff(const ReconnectPolicy& policy, std::size_t address_count, std::uint64_t random)
      : policy_(policy), address_count_(address_count), random_(random) {}

  /// 0 while there are addresses that have not been tried. Then between one and two halves of a
  /// pause that doubles up to the longest, with each round over the addresses.
  std::chrono::milliseconds NextPause();

 private:
  ReconnectPolicy policy_;
  std::size_t address_count_;
  std::uint64_t random_;
  std::size_t attempts_ = 0;
};

}  // namespace partiemc::client
