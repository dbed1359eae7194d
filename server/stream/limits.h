// What a server allows, announced to clients in StreamOpened and GetServerInfo.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>

#include "partiemc/frame.h"
#include "server/stream/stream_state_machine.h"
#include "server/stream/unary_state_machine.h"

namespace partiemc::server {

/// At the worst, requests, answers, the buffers of compute threads and histories hold
/// `memory_budget`, the frames of a few streams (ReadBytesBeyond) and what one frame is computed
/// with (WorkerBytesBeyond). Outside of it each thread has 16 MiB for its buffers. MemoryPlan adds
/// it up.
struct ServerLimits {
  /// Of one frame. More suits larger simulations; memory grows with it as said above.
  FrameLimits frame{.max_particles = 4'000'000, .max_tiles = 131'072};

  /// Of one serialised ParticleFrame; by default DefaultFrameBytes(frame.max_particles), and of a
  /// server's command line at most an eighth of its memory budget.
  std::uint64_t max_frame_bytes = DefaultFrameBytes(4'000'000);

  /// Of one message of a client. A stream ends whose message is larger than that, so it is somewhat
  /// more than was announced: a frame that is slightly too large is answered by a FrameError
  /// instead.
  std::uint64_t MaxMessageBytes() const {
    return std::min<std::uint64_t>(max_frame_bytes + max_frame_bytes / 4,
                                   std::numeric_limits<std::int32_t>::max());
  }

  /// Of one checkpoint, sent or taken. A state has a byte or two for each particle of a body, 370
  /// or more for each that lies alone; what tiles and particles bound it to is far beyond any
  /// message, so nothing but that does: `open` is to be no larger than a frame.
  std::uint64_t MaxCheckpointBytes() const { return max_frame_bytes; }

  /// Streams that are open at once, and, counted apart, calls of ReconstructFrame.
  std::uint32_t max_streams = 32;

  /// Frames of a stream that are read ahead of the last answer that its client has taken. Two keep
  /// large frames flowing, four small ones; more only costs memory.
  std::uint32_t frames_in_flight = 4;

  /// Bytes that requests, answers, compute threads and histories hold together. While it is used
  /// up, a stream is read from only when nothing of it is in flight and it has a slot for a frame
  /// beyond the budget. More suits many large streams.
  std::uint64_t memory_budget = std::uint64_t{1} << 30;

  /// Streams that may have a frame beyond the budget at the same time, at least 1.
  std::uint32_t streams_beyond_budget = 2;

  /// What those frames hold: one message a stream. Frames in parts can hold two, as part 0 counts
  /// apart from the others.
  std::uint64_t ReadBytesBeyond() const {
    return streams_beyond_budget * (max_parts > 0 ? 2 : 1) * MaxMessageBytes();
  }
  /// What one worker at a time may hold beyond the budget: the buffers for a compact body of the
  /// most particles that a frame has.
  std::uint64_t WorkerBytesBeyond() const {
    const std::uint64_t most =
        std::min<std::uint64_t>(frame.max_particles, max_frame_bytes / kLeastBytesOfParticle);
    return kBytesOfCompactParticle * most;
  }
  /// Two float32.
  static constexpr std::uint64_t kLeastBytesOfParticle = 8;
  /// With all that a frame is computed with (core/src/workspace_bytes.h): 60 bytes, and its part of
  /// the tiles.
  static constexpr std::uint64_t kBytesOfCompactParticle = 80;

  /// Results of one stream that watchers can go back to, with 512 bytes for each of them; 0: none.
  std::uint64_t history_bytes = std::uint64_t{64} << 20;

  /// Of all streams, in equal shares: an eighth of the budget at most, set apart for them so that
  /// no frame ever waits for what somebody might want to see again.
  std::uint64_t AllHistoryBytes() const {
    const std::uint64_t most = memory_budget / 8;
    return history_bytes <= most / std::max(1u, max_streams) ? history_bytes * max_streams : most;
  }
  /// What is left of the budget for everything else.
  std::uint64_t FrameBudget() const { return memory_budget - AllHistoryBytes(); }

  /// A stream costs next to nothing while it waits, but it keeps its name and its place.
  IdleLimits idle{.opening = std::chrono::seconds(30), .streaming = std::chrono::hours(1)};

  /// Of calls of one request. An answer that is not taken in time is given up, as it holds memory.
  UnaryLimits unary{.request = std::chrono::seconds(30), .answer = std::chrono::minutes(2)};

  /// Watchers of all streams together.
  std::uint32_t max_watchers = 64;

  /// Parts that frames of a stream may come in, and, counted apart, connections that send parts,
  /// those of part 0 left out, of all streams together. 0: frames come whole.
  std::uint32_t max_parts = 256;

  /// What one watcher may keep from being freed: the frames that it has not taken yet, of which
  /// most are shared with other watchers. A larger frame cannot be watched.
  std::uint64_t max_watcher_bytes = std::uint64_t{16} << 20;

  /// The newest result of a stream is kept for watchers to come if it is no larger: 64 MiB for all
  /// streams together.
  std::uint64_t KeptResultBytes() const { return (std::uint64_t{64} << 20) / max_streams; }

  /// Calls of all methods that have begun without their request.
  std::uint32_t MaxOpeningCalls() const { return std::max(64u, max_streams + max_watchers); }

  /// Calls of one caller, of all methods, unless its token says otherwise: room for all that is
  /// limited by itself, and for what just ends and begins.
  std::uint32_t CallsOfOneCaller() const { return 4 * MaxOpeningCalls() + max_parts; }

  /// Of a serialised `open`: its checkpoint, and what little stands beside it.
  std::uint64_t MaxOpenBytes() const { return MaxCheckpointBytes() + kQuickOpenBytes; }

  /// Room for the widest usual particle (three float64, id, volume, velocity: 44 bytes) and for
  /// what a message has besides. Recordings with many scalars want a larger limit by hand.
  static constexpr std::uint64_t DefaultFrameBytes(std::uint64_t max_particles) {
    return 48 * max_particles + 4096;
  }
};

}  // namespace partiemc::server
