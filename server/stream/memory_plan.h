// Computes the maximum memory of a server from its limits, before the server starts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/stream/limits.h"

namespace partiemc::server {

/// The maximum memory, as a sum of parts. ReadPermits and WorkerMemory enforce it for counted
/// bytes, IntakeGuard for the whole process.
struct MemoryPlan {
  struct Part {
    std::uint64_t bytes = 0;
    std::string what;  ///< The use of the memory, and the flag that sets its size.
  };

  /// `threads`: number of compute threads.
  MemoryPlan(const ServerLimits& limits, unsigned threads);

  std::uint64_t bytes() const;
  /// Returns the plan as a readable table, whose last line is the sum.
  std::string ToString() const;

  std::vector<Part> parts;
};

/// Bytes of the newest results that all streams keep for later watchers
/// (ServerLimits::KeptResultBytes), as far as they exceed the histories. A stream keeps such a
/// result only while its history is empty.
std::uint64_t KeptBytesBeyondHistories(const ServerLimits& limits);

/// Bytes that a connection may buffer before the server reads the messages of its call.
inline constexpr std::uint64_t kUnreadBytes = 256 << 10;

/// Results that watchers have not received yet, and kept levels of detail, may use 1/16 of the
/// budget in addition to it.
inline constexpr std::uint64_t kPartsOfBudgetBeyond = 16;

}  // namespace partiemc::server
