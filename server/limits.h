// What a server allows, announced to clients in StreamOpened and GetServerInfo.
#pragma once

#include <cstdint>

#include "partiemc/frame.h"

namespace partiemc::server {

/// At the worst, requests hold max_streams * frames_in_flight * max_frame_bytes of memory, and
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

  /// Room for the widest usual particle (three float64, id, volume, velocity: 44 bytes) and for
  /// what a message has besides. Recordings with many scalars want a larger limit by hand.
  static constexpr std::uint64_t DefaultFrameBytes(std::uint64_t max_particles) {
    return 48 * max_particles + 4096;
  }
};

}  // namespace partiemc::server
