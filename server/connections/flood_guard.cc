#include "server/connections/flood_guard.h"

#include <map>

namespace partiemc::server {
namespace {

using Amount = std::uint64_t (*)(const TrackedConnection&);

// Returns nothing if the sum of the amounts of all connections is at most `most`. Otherwise finds
// the address with the largest sum, and returns the index of its connection with the largest
// amount.
std::optional<std::size_t> LargestOfLargest(const std::vector<ExaminedConnection>& connections,
                                            Amount amount, std::uint64_t most) {
  std::map<std::string_view, std::uint64_t> sums;
  std::uint64_t all = 0;
  for (const auto& [connection, address] : connections) {
    const std::uint64_t one = amount(*connection);
    if (one == 0) continue;
    all += one;
    sums[*address] += one;
  }
  if (all <= most) return std::nullopt;
  std::string_view largest_address;
  std::uint64_t largest_sum = 0;
  for (const auto& [address, sum] : sums) {
    if (sum <= largest_sum) continue;
    largest_sum = sum;
    largest_address = address;
  }
  std::optional<std::size_t> largest;
  for (std::size_t k = 0; k < connections.size(); ++k) {
    if (*connections[k].address != largest_address) continue;
    if (!largest || amount(*connections[k].connection) > amount(*connections[*largest].connection))
      largest = k;
  }
  return largest;
}

}  // namespace

std::optional<Excess> LargestExcess(const std::vector<ExaminedConnection>& connections,
                                    const ConnectionRules& rules) {
  const auto bytes = [](const TrackedConnection& one) { return one.ledger.excess(); };
  const auto streams = [](const TrackedConnection& one) { return one.ledger.streams(); };
  if (rules.unaccounted_bytes > 0) {
    if (const auto index =
            LargestOfLargest(connections, bytes, kConnectionsAtLimit * rules.unaccounted_bytes)) {
      return Excess{*index, Flood::kUnaccountedBytes};
    }
  }
  if (rules.max_streams > 0) {
    if (const auto index =
            LargestOfLargest(connections, streams, kConnectionsAtLimit * rules.max_streams)) {
      return Excess{*index, Flood::kStreams};
    }
  }
  return std::nullopt;
}

std::optional<std::size_t> IdleOfLargestAddress(const std::vector<ExaminedConnection>& connections,
                                                const ConnectionCounts& counts) {
  std::optional<std::size_t> idle;
  std::size_t most = 0;
  for (std::size_t k = 0; k < connections.size(); ++k) {
    const auto& [connection, address] = connections[k];
    if (connection->admission != Admission::kKept || connection->ledger.calls_open() > 0) continue;
    if (const std::size_t count = counts.CountOf(*address); count > most) {
      most = count;
      idle = k;
    }
  }
  return idle;
}

}  // namespace partiemc::server
