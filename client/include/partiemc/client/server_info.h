// What a server is and what it allows.
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

/// What a server is busy with at the moment.
struct ServerLoad {
  std::uint32_t watchers = 0;        ///< Of all streams.
  std::uint64_t frames_waiting = 0;  ///< For a thread that computes them.
  std::uint64_t memory_held = 0;     ///< Bytes of requests and answers of all streams.
  std::uint64_t memory_budget = 0;   ///< What they may hold together.
  std::uint64_t watched_bytes = 0;   ///< Not taken by watchers yet; outside of the budget.
};

struct ServerInfo {
  std::string version;
  std::uint32_t method_version = 0;  ///< Changes whenever the same input would give other digests.
  StreamLimits limits;
  std::uint32_t max_streams = 0;
  std::uint32_t max_watchers = 0;
  std::uint32_t idle_timeout_seconds = 0;  ///< 0: none.
  std::uint32_t frames_in_flight = 0;
  std::uint32_t compute_threads = 0;
  std::vector<Placement> placements;  ///< Those that this client knows too.
  std::vector<Fill> fills;
  std::vector<std::string> capabilities;
  std::uint32_t open_streams = 0;
  bool draining = false;
  std::optional<ServerLoad> load = {};  ///< Not of a server of version 0.1.
};

/// Asks the server at `address` (HOST:PORT, [IPV6]:PORT or unix:PATH).
/// Errors: INVALID_ARGUMENT (address, credentials), UNAVAILABLE (no server there, or one of the two
/// does not trust the other), UNAUTHENTICATED (token), DEADLINE_EXCEEDED.
absl::StatusOr<ServerInfo> GetServerInfo(
    std::string_view address, std::chrono::milliseconds deadline = std::chrono::seconds(5),
    const Credentials& credentials = {});

}  // namespace partiemc::client
