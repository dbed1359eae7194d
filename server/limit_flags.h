// The flags of the server's limits: of streams, frames and memory, and of the connections of
// --address.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "server/server.h"

namespace CLI {
class App;
}

namespace partiemc::server {

/// Values of flags from which limits are computed after all flags are known.
struct LimitFlags {
  std::uint64_t max_frame_bytes = 0;  ///< 0: the default (FrameBytes).
  std::string caller_limits;          ///< Text of ParseCallerQuota.
  double idle_seconds = std::chrono::duration<double>(ServerLimits{}.idle.streaming).count();
};

/// Adds the flags that set `limits` and `flags`. Both must live until `app` has parsed.
void AddLimitFlags(CLI::App& app, ServerLimits& limits, LimitFlags& flags);

/// Adds the flags of connections. `options` must live until `app` has parsed.
void AddConnectionFlags(CLI::App& app, ServerOptions& options);

/// The maximum size of a serialised frame in bytes: the value of the flag if it was given,
/// otherwise the default for `limits`.
std::uint64_t FrameBytes(const LimitFlags& flags, const ServerLimits& limits);

}  // namespace partiemc::server
