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

  /// `threads` that compute. ReadPermits and WorkerMemory keep what is counted within it,
  /// IntakeGuard the process.
  MemoryPlan(const ServerLimits& limits, unsigned threads);

  std::uint64_t bytes() const;
  /// A table for a person; the last line is the sum.
  std::string ToString() const;

  std::vector<Part> parts;
};

/// What a call may send before it is read, in its connection.
inline constexpr std::uint64_t kUnreadBytes = 256 << 10;

/// Results that watchers have not taken refuse no caller up to one of so many parts of the budget.
inline constexpr std::uint64_t kPartsOfBudgetBeyond = 16;

}  // namespace partiemc::server
