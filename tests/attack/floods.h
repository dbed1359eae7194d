// Floods of HTTP/2 frames below the level of calls, which need no token.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>

#include "attack/http2_client.h"

namespace partiemc::attack {

struct Flood {
  const char* name;
  const char* what;
  /// Queues the first bytes of a connection. Its calls have the headers `more`. Returns the stream
  /// that the flood then uses, or 0.
  std::uint32_t (*begin)(Http2Client&, const Headers& more);
  /// Queues some tens of kilobytes of the flood.
  void (*queue)(Http2Client&, std::uint32_t stream);
};

/// All floods.
std::span<const Flood> Floods();

struct FloodSettings {
  std::string address;
  /// The attacker's address, different from the honest clients', so that limits per address do not
  /// affect them.
  std::string source = "127.0.0.2";
  std::string token;  ///< Of calls that come first in a connection; empty: none.
  bool tls = false;
  std::chrono::milliseconds time{4'000};
  double bytes_per_second = 0;  ///< 0: no limit.
  std::uint64_t most_bytes = std::uint64_t{2} << 30;
  std::size_t connections = 1;  ///< Threads with one connection each.
  /// The attackers run only on idle processors, because real ones share none with the server.
  bool yield_processors = false;
};

struct FloodOutcome {
  std::uint64_t bytes = 0;        ///< Passed to the kernel.
  std::uint64_t connections = 0;  ///< Opened connections; each lost one is replaced.
  std::uint64_t refused = 0;      ///< Refused attempts to connect.
};

/// Floods until the time or the bytes are used up. Replaces each lost connection.
FloodOutcome RunFlood(const Flood& flood, const FloodSettings& settings);

}  // namespace partiemc::attack
