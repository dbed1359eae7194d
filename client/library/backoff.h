// Pauses between attempts to reach a server.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "partiemc/client/stream.h"

namespace partiemc::client {

/// Computes the pauses between the attempts to reconnect after one loss of a connection.
class Backoff {
 public:
  /// `random` seeds the jitter, so that clients do not retry at the same moment.
  Backoff(const ReconnectPolicy& policy, std::size_t address_count, std::uint64_t random)
      : policy_(policy), address_count_(address_count), random_(random) {}

  /// Returns the pause before the next attempt. It is 0 until every address has been tried once.
  /// Then the first attempt of each round over the addresses has a pause, the others have none. The
  /// pause doubles from round to round, up to the longest. The jitter removes up to half of it.
  std::chrono::milliseconds NextPause();

 private:
  ReconnectPolicy policy_;
  std::size_t address_count_;
  std::uint64_t random_;
  std::size_t attempts_ = 0;
};

}  // namespace partiemc::client
