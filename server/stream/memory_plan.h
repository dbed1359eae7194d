// The maximum memory of a server, computed from its limits before it starts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/stream/limits.h"

namespace partiemc::server {

/// ReadPermits and WorkerMemory enforce it for counted bytes, IntakeGuard for the whole process.
struct MemoryPlan {
  struct Part {
    std::uint64_t bytes = 0;
    std::string what;  ///< The use of the memory, and the flag that sets its size.
  };

  /// `threads`: number of compute threads.
  MemoryPlan(const ServerLimits& limits, unsigned threads);

  std::uint64_t bytes() const;
  /// A readable table. The last line is the sum.
  std::string ToString() const;

  std::vector<Part> parts;
};

/// Bytes that a connection buffers before the server reads the call's messages.
inline constexpr std::uint64_t kUnreadBytes = 256 << 10;

/// Results that watchers have not received may use 1/16 of the budget in addition to it.
inline constexpr std::uint64_t kPartsOfBudgetBeyond = 16;

}  // namespace partiemc::server
