#include "server/limit_flags.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>

namespace partiemc::server {
namespace {

// Maximum of --max-frame-bytes and --max-watcher-bytes: gRPC's limit for a received message is 1.25
// times this value and must fit into an int.
constexpr std::uint64_t kMaxFrameBytes = std::numeric_limits<std::int32_t>::max() / 5 * 4;

// The default of --max-frame-bytes is at most 1/kFramesInBudget of the memory budget, because a
// frame is in memory before the budget counts it. It may be kLeastFrameBytes even if the budget is
// very small; then streams progress one frame at a time.
constexpr std::uint64_t kFramesInBudget = 8;
constexpr std::uint64_t kLeastFrameBytes = 4 << 20;

}  // namespace

void AddLimitFlags(CLI::App& app, ServerLimits& limits, LimitFlags& flags) {
  const char* const kGroup = "Limits";
  app.add_option("--max-streams", limits.max_streams,
                 "Maximum number of open streams; further ones are refused")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_STREAMS")
      ->group(kGroup);
  app.add_option("--frames-in-flight", limits.frames_in_flight,
                 "Window of a stream: frames accepted before their results are received")
      ->check(CLI::Range(1, 64))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_FRAMES_IN_FLIGHT")
      ->group(kGroup);
  app.add_option("--max-watchers", limits.max_watchers,
                 "Maximum number of watchers of all streams; further ones are refused")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_WATCHERS")
      ->group(kGroup);
  app.add_option("--max-parts", limits.max_parts,
                 "Maximum number of parts of a frame, and of connections that send parts for all "
                 "streams; 0: no parts")
      ->check(CLI::Range(0, 10'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_PARTS")
      ->group(kGroup);
  app.add_option("--max-watcher-bytes", limits.max_watcher_bytes,
                 "Memory limit of one watcher, with a unit as in 16MB; larger results cannot be "
                 "watched")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{4096}, kMaxFrameBytes))
      ->capture_default_str()
      ->type_name("BYTES")
      ->envname("PARTIEMC_MAX_WATCHER_BYTES")
      ->group(kGroup);
  app.add_option("--history-bytes", limits.history_bytes,
                 "History of a stream for watchers that join late or go back, with a unit as in "
                 "64MB; the oldest results are dropped. All histories share an eighth of "
                 "--memory-budget equally; 0: none")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 50))
      ->capture_default_str()
      ->type_name("BYTES")
      ->envname("PARTIEMC_HISTORY_BYTES")
      ->group(kGroup);
  app.add_option("--max-particles", limits.frame.max_particles,
                 "Maximum number of particles of a frame")
      ->check(CLI::Range(std::size_t{1}, FrameLimits::kMostParticles))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_PARTICLES")
      ->group(kGroup);
  app.add_option(
         "--max-tiles", limits.frame.max_tiles,
         "Maximum number of tiles (32 x 32 lattice nodes) of a frame; a tile takes 10 kB, and "
         "more with many drops")
      ->check(CLI::Range(std::size_t{1}, FrameLimits::kMostTiles))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_TILES")
      ->group(kGroup);
  app.add_option(
         "--max-frame-bytes", flags.max_frame_bytes,
         "Maximum size of a serialised frame, with a unit as in 200MB (default: 48 bytes per "
         "particle of --max-particles, at most an eighth of --memory-budget)")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{1}, kMaxFrameBytes))
      ->type_name("BYTES")
      ->envname("PARTIEMC_MAX_FRAME_BYTES")
      ->group(kGroup);
  app.add_option(
         "--memory-budget", limits.memory_budget,
         "Memory for requests, responses, workers and histories of all streams, with a unit as in "
         "2GB. "
         "When it is used up, streams take turns with one frame each (default: half of the "
         "memory of this machine or container)")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::PositiveNumber)
      ->type_name("BYTES")
      ->envname("PARTIEMC_MEMORY_BUDGET")
      ->group(kGroup);
  app.add_option(
         "--streams-beyond-budget", limits.streams_beyond_budget,
         "Maximum number of streams with a frame beyond --memory-budget at the same time; the "
         "others wait. A larger number takes more memory and shortens the wait for large frames")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_STREAMS_BEYOND_BUDGET")
      ->group(kGroup);
  app.add_option(
         "--caller-limits", flags.caller_limits,
         "Limits of each caller, as in \"streams=4 watchers=16 calls=64 bytes=64MB\" (default: "
         "none for streams, watchers and bytes). A caller is a token, whose line in --token-file "
         "takes precedence, or without tokens an address. Behind a proxy all clients without a "
         "token are one caller")
      ->type_name("LIMITS")
      ->envname("PARTIEMC_CALLER_LIMITS")
      ->group(kGroup);
  app.add_option("--idle-timeout", flags.idle_seconds,
                 "End a stream that sends no frame for this time; 0: never")
      ->check(CLI::Range(0.0, 1e8))
      ->capture_default_str()
      ->type_name("SECONDS")
      ->envname("PARTIEMC_IDLE_TIMEOUT")
      ->group(kGroup);
}

void AddConnectionFlags(CLI::App& app, ServerOptions& options) {
  ConnectionLimits& limits = options.connections;
  const char* const kGroup = "Connections of --address";
  app.add_option(
         "--max-connections", limits.connections,
         "Maximum number of connections, at most half of the file descriptors. Above it, a "
         "connection without a call is closed; if all have calls, the new one may only make "
         "health checks")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_CONNECTIONS")
      ->group(kGroup);
  app.add_option(
         "--connections-per-address", limits.of_address,
         "Maximum number of connections of one address, except for health checks; 0: no limit, "
         "for a server behind a proxy")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_CONNECTIONS_PER_ADDRESS")
      ->group(kGroup);
  app.add_option(
         "--new-connections-per-address", limits.new_of_address,
         "Maximum rate of new connections of one address per second, with bursts of twice the "
         "rate, except for health checks; 0: no limit, for a server behind a proxy")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_NEW_CONNECTIONS_PER_ADDRESS")
      ->group(kGroup);
  app.add_option(
         "--unaccounted-bytes", options.unaccounted_bytes,
         "Maximum number of bytes of a TCP connection that belong to no call and no message, with "
         "a unit as in 512KiB. A connection above it is cut, and its address may only make "
         "health checks for ten seconds; 0: no limit")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 40))
      ->capture_default_str()
      ->type_name("BYTES")
      ->envname("PARTIEMC_UNACCOUNTED_BYTES")
      ->group(kGroup);
}

std::uint64_t FrameBytes(const LimitFlags& flags, const ServerLimits& limits) {
  if (flags.max_frame_bytes != 0) return flags.max_frame_bytes;
  return std::min({ServerLimits::DefaultFrameBytes(limits.frame.max_particles), kMaxFrameBytes,
                   std::max(limits.memory_budget / kFramesInBudget, kLeastFrameBytes)});
}

}  // namespace partiemc::server
