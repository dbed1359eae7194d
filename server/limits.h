// What a server allows, announced to clients in StreamOpened and GetServerInfo.
#pragma once

#include <chrono>
#include <cstdint>

#include "partiemc/frame.h"
#include "server/stream_flow.h"

namespace partiemc::server {

/// At the worst, requests and answers hold `memory_budget` and one frame for each stream, and
/// computing takes about 200 bytes a particle for each thread.
struct ServerLimits {
  /// Of one frame. More suits larger simulations; memory grows with it as said above.
  FrameLimits frame{.max_particles = 4'000'000, .max_tiles = 131'072};

  /// Of one serialised ParticleFrame; by default DefaultFrameBytes(frame.max_particles).
  std::uint64_t max_frame_bytes = DefaultFrameBytes(4'000'000);

  /// Streams that are open at once, and, counted apart, calls of ReconstructFrame.
  std::uint32_t max_streams = 32;

  /// Frames of a stream that are read ahead of the last answer that its client has taken. Two keep
  /// large frames flowing, four small ones; more only costs memory.
  std::uint32_t frames_in_flight = 4;

  /// Bytes that requests and answers of all streams hold together. While it is used up, a stream is
  /// read from only when nothing of it is in flight. More suits many large streams.
  std::uint64_t memory_budget = std::uint64_t{1} << 30;

  /// A stream costs next to nothing while it waits, but it keeps its name and its place.
  IdleLimits idle{.opening = std::chrono::seconds(30), .streaming = std::chrono::hours(1)};

  /// Watchers of all streams together.
  std::uint32_t max_watchers = 64;

  /// What one watcher may keep from being freed: the frames that it has not taken yet, of which
  /// most are shared with other watchers. A larger frame cannot be watched.
  std::uint64_t max_watcher_bytes = std::uint64_t{16} << 20;

  /// The newest result of a stream is kept for watchers to come if it is no larger: 64 MiB for all
  /// streams together.
  std::uint64_t KeptResultBytes() const { return (std::uint64_t{64} << 20) / max_streams; }

  /// Room for the widest usual particle (three float64, id, volume, velocity: 44 bytes) and for
  /// what a message has besides. Recordings with many scalars want a larger limit by hand.
  static constexpr std::uint64_t DefaultFrameBytes(std::uint64_t max_particles) {
    return 48 * max_particles + 4096;
  }
};

}  // namespace partiemc::server
