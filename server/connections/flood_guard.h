// Examines all connections together and names those to cut.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/connections/connection_table.h"

namespace partiemc::server {

/// All connections together have this multiple of the limit of one. Otherwise many connections,
/// each below its own limit, would fill the memory.
inline constexpr std::uint64_t kConnectionsAtLimit = 2;

/// One connection as the guard sees it.
struct ExaminedConnection {
  const TrackedConnection* connection = nullptr;
  const std::string* address = nullptr;
};

/// The connection to cut where all of them are beyond `kConnectionsAtLimit` times the rules of one:
/// of the address that has most, its largest. Nothing where they are within.
struct Excess {
  std::size_t index = 0;
  Flood flood = Flood::kUnaccountedBytes;
};
std::optional<Excess> LargestExcess(const std::vector<ExaminedConnection>& connections,
                                    const ConnectionRules& rules);

/// The connection that ends where one more is to be kept: of the address that has most connections,
/// the first without a call. `connections` in the order in which they came. Nothing where all have
/// calls.
std::optional<std::size_t> IdleOfLargestAddress(const std::vector<ExaminedConnection>& connections,
                                                const ConnectionCounts& counts);

}  // namespace partiemc::server
