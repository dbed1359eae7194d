// Examines all connections together and selects connections to end.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/connections/connection_table.h"

namespace partiemc::server {

/// All connections together may reach this multiple of the limit of one connection. Otherwise many
/// connections, each below its own limit, would exhaust the memory.
inline constexpr std::uint64_t kConnectionsAtLimit = 2;

/// A connection and its address.
struct ExaminedConnection {
  const TrackedConnection* connection = nullptr;
  const std::string* address = nullptr;
};

/// The connection to cut if all connections together exceed a limit: the one with the largest
/// excess (or most streams) of the address with the largest sum. None if they are within the
/// limits.
struct Excess {
  std::size_t index = 0;
  Flood flood = Flood::kUnaccountedBytes;
};
std::optional<Excess> LargestExcess(const std::vector<ExaminedConnection>& connections,
                                    const ConnectionRules& rules);

/// The connection to evict for a new one: the oldest connection without a call, of the address with
/// the most connections. None if all have calls. Requires: `connections` in the order of arrival.
std::optional<std::size_t> IdleOfLargestAddress(const std::vector<ExaminedConnection>& connections,
                                                const ConnectionCounts& counts);

}  // namespace partiemc::server
