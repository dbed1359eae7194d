// What memory a server takes at most, before it is started.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/stream/limits.h"

namespace partiemc::server {

struct MemoryPlan {
  struct Part {
    std::uint64_t bytes = 0;
    std::string what;  ///< And which flag decides on it.
  };

  /// `threads` that compute. As IntakeGuard holds the process to it: beyond it callers are refused,
  /// but for a frame that is larger than what is left, and the tiles of drops that lie far apart
  /// (worker_memory.h).
  MemoryPlan(const ServerLimits& limits, unsigned threads);

  std::uint64_t bytes() const;
  /// A table for a person; the last line is the sum.
  std::string ToString() const;

  std::vector<Part> parts;
};

/// Of what streams may have in flight, and apart from that watchers may not have taken, so much
/// more than is planned turns nobody away: one of so many parts of the budget.
inline constexpr std::uint64_t kPartsOfBudgetBeyond = 16;

}  // namespace partiemc::server
