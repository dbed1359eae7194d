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

/// All connections together may reach this multiple of each limit of one connection. Otherwise many
/// connections, each below its own limit, could exhaust the memory.
inline constexpr std::uint64_t kConnectionsAtLimit = 2;

/// A connection and its address (Peer::address).
struct ExaminedConnection {
  const TrackedConnection* connection = nullptr;
  const std::string* address = nullptr;
};

/// A connection to cut, and the reason.
struct Excess {
  std::size_t index = 0;  ///< In the `connections` of LargestExcess.
  Flood flood = Flood::kUnaccountedBytes;
};
/// Returns the connection to cut if all connections together exceed a limit, else nothing. First
/// compares their unaccounted bytes (ConnectionLedger::excess), then their streams, with
/// kConnectionsAtLimit times the limit of one connection. The connection to cut has the most of the
/// exceeded quantity at its address. The address has the largest sum of this quantity.
std::optional<Excess> LargestExcess(const std::vector<ExaminedConnection>& connections,
                                    const ConnectionRules& rules);

/// Returns the index of the connection to evict for a new one: a kept connection without a call. If
/// there are several, it is the oldest one of the address with the most connections. Returns
/// nothing if there is none. Requires: `connections` are in the order of arrival.
std::optional<std::size_t> IdleOfLargestAddress(const std::vector<ExaminedConnection>& connections,
                                                const ConnectionCounts& counts);

}  // namespace partiemc::server
