// Version, limits and load of a server.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/client/credentials.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/parameters.h"

namespace partiemc::client {

/// Current load of a server.
struct ServerLoad {
  std::uint32_t watchers = 0;        ///< Watchers of all streams.
  std::uint64_t frames_waiting = 0;  ///< Frames waiting for a compute thread.
  std::uint64_t memory_held = 0;     ///< Bytes of requests and responses of all streams.
  std::uint64_t memory_budget = 0;   ///< Limit of memory_held.
  std::uint64_t watched_bytes =
      0;  ///< Bytes not yet delivered to watchers; not part of the budget.
};

struct ServerInfo {
  std::string version;
  std::uint32_t method_version = 0;  ///< Changes when the same input gives different digests.
  StreamLimits limits;
  std::uint32_t max_streams = 0;
  std::uint32_t max_watchers = 0;
  std::uint32_t idle_timeout_seconds = 0;  ///< 0: no timeout.
  std::uint32_t frames_in_flight = 0;      ///< Capacity of the window of each stream.
  std::uint32_t compute_threads = 0;
  // Only placements and fills that this client knows:
  std::vector<Placement> placements;
  std::vector<Fill> fills;
  std::vector<std::string> capabilities;  ///< See proto/PROTOCOL.md.
  std::uint32_t open_streams = 0;
  bool draining = false;
  std::optional<ServerLoad> load = {};  ///< Absent for servers that do not report it.
};

/// Requests the information from the server at `address` (HOST:PORT, [IPV6]:PORT or unix:PATH).
/// Errors: INVALID_ARGUMENT (address, credentials), UNAVAILABLE (no server, or TLS verification
/// failed), UNAUTHENTICATED (token), DEADLINE_EXCEEDED.
absl::StatusOr<ServerInfo> GetServerInfo(
    std::string_view address, std::chrono::milliseconds deadline = std::chrono::seconds(5),
    const Credentials& credentials = {});

}  // namespace partiemc::client
