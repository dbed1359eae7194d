// Examines all connections together, and selects the connection to end if they exceed a common
// limit.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/connections/connection_table.h"

namespace partiemc::server {

/// All connections together may reach this multiple of the limit of one connection. Without this
/// limit, many connections that are each below their own limit could exhaust the memory.
inline constexpr std::uint64_t kConnectionsAtLimit = 2;

/// A connection and its address.
struct ExaminedConnection {
  const TrackedConnection* connection = nullptr;
  const std::string* address = nullptr;
};

/// The connection to cut if all connections together exceed a limit. It is the connection with the
/// largest excess (or the most streams) of the address with the largest sum.
struct Excess {
  std::size_t index = 0;
  Flood flood = Flood::kUnaccountedBytes;
};
std::optional<Excess> LargestExcess(const std::vector<ExaminedConnection>& connections,
                                    const ConnectionRules& rules);

/// Returns the index of the connection to evict for a new one: the oldest connection without a
/// call, of the address with the most connections. Returns nothing if all connections have calls.
/// Requires: `connections` are in the order of arrival.
std::optional<std::size_t> IdleOfLargestAddress(const std::vector<ExaminedConnection>& connections,
                                                const ConnectionCounts& counts);

}  // namespace partiemc::server
