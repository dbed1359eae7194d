// The limits of a server. StreamOpened and GetServerInfo announce them to clients.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>

#include "partiemc/frame.h"
#include "server/stream/stream_state_machine.h"
#include "server/stream/unary_state_machine.h"

namespace partiemc::server {

/// Maximum memory (MemoryPlan computes the sum):
/// - `memory_budget` for requests, responses, workers and histories;
/// - frames beyond the budget (ReadBytesBeyond);
/// - the worker of one frame beyond the budget (WorkerBytesBeyond);
/// - 16 MiB of buffers for each compute thread, which do not count in the budget.
struct ServerLimits {
  /// Limits of one frame. Larger simulations need higher limits; memory grows with them.
  FrameLimits frame{.max_particles = 4'000'000, .max_tiles = 131'072};

  /// Maximum size of a serialised ParticleFrame. The default on the server's command line is
  /// DefaultFrameBytes(frame.max_particles), but at most an eighth of the memory budget.
  std::uint64_t max_frame_bytes = DefaultFrameBytes(4'000'000);

  /// Maximum size of a client's message. A larger message ends the stream. It is a quarter more
  /// than the announced `max_frame_bytes`, so that the response to a slightly too large frame is a
  /// FrameError, and the stream continues.
  std::uint64_t MaxMessageBytes() const {
    return std::min<std::uint64_t>(max_frame_bytes + max_frame_bytes / 4,
                                   std::numeric_limits<std::int32_t>::max());
  }

  /// Maximum size of a checkpoint, sent or received. The limit keeps `open` no larger than a frame.
  /// A state has one or two bytes for each particle of a body, and 370 or more for an isolated
  /// particle. The limits of tiles and particles alone would permit states larger than any message.
  std::uint64_t MaxCheckpointBytes() const { return max_frame_bytes; }

  /// Maximum number of open streams. The same number limits calls of ReconstructFrame separately.
  std::uint32_t max_streams = 32;

  /// Maximum number of a stream's frames between the server's read and the end of the response's
  /// write. Two suffice for large frames, four for small ones; more only costs memory.
  std::uint32_t frames_in_flight = 4;

  /// Bytes that requests, responses, workers and histories hold together. While it is exhausted, a
  /// stream reads only if it has no frame in flight and gets a slot for a frame beyond the budget.
  /// Many large streams need more.
  std::uint64_t memory_budget = std::uint64_t{1} << 30;

  /// Maximum number of streams with a frame beyond the budget, at least 1.
  std::uint32_t streams_beyond_budget = 2;

  /// Maximum size of all frames beyond the budget: one message for each stream, two if frames
  /// arrive in parts, because part 0 is counted separately.
  std::uint64_t ReadBytesBeyond() const {
    return streams_beyond_budget * (max_parts > 0 ? 2 : 1) * MaxMessageBytes();
  }
  /// Maximum size of the one worker beyond the budget: the buffers for a compact body with the
  /// maximum number of particles.
  std::uint64_t WorkerBytesBeyond() const {
    const std::uint64_t most =
        std::min<std::uint64_t>(frame.max_particles, max_frame_bytes / kLeastBytesOfParticle);
    return kBytesOfCompactParticle * most;
  }
  /// Minimum bytes of a particle in a message: two float32.
  static constexpr std::uint64_t kLeastBytesOfParticle = 8;
  /// A worker's bytes for a particle of a compact body (core/src/workspace_bytes.h): 60 bytes, and
  /// its share of the tiles.
  static constexpr std::uint64_t kBytesOfCompactParticle = 80;

  /// Maximum size of one stream's history, including 512 bytes for each result; 0: no history.
  std::uint64_t history_bytes = std::uint64_t{64} << 20;

  /// Maximum size of all histories together, in equal shares: at most an eighth of the budget. It
  /// is reserved, so that no frame waits for memory that old results hold.
  std::uint64_t AllHistoryBytes() const {
    const std::uint64_t most = memory_budget / 8;
    return history_bytes <= most / std::max(1u, max_streams) ? history_bytes * max_streams : most;
  }
  /// The budget without the histories.
  std::uint64_t FrameBudget() const { return memory_budget - AllHistoryBytes(); }

  /// An idle stream costs little, but it occupies a name and a slot.
  IdleLimits idle{.opening = std::chrono::seconds(30), .streaming = std::chrono::hours(1)};

  /// Limits of unary calls. A response that is not received in time is dropped, since it holds
  /// memory.
  UnaryLimits unary{.request = std::chrono::seconds(30), .answer = std::chrono::minutes(2)};

  /// Maximum number of watchers of all streams together.
  std::uint32_t max_watchers = 64;

  /// Maximum number of parts of a frame. The same number limits the connections that send parts 1
  /// and above, for all streams together. 0: frames arrive whole.
  std::uint32_t max_parts = 256;

  /// Maximum memory that one watcher can pin: its undelivered frames, which it mostly shares with
  /// other watchers. A larger frame is not sent to watchers.
  std::uint64_t max_watcher_bytes = std::uint64_t{16} << 20;

  /// Maximum size of a stream's last result that is kept for new watchers: 64 MiB divided by the
  /// number of streams.
  std::uint64_t KeptResultBytes() const { return (std::uint64_t{64} << 20) / max_streams; }

  /// Maximum number of calls of all methods that have not sent their first request.
  std::uint32_t MaxOpeningCalls() const { return std::max(64u, max_streams + max_watchers); }

  /// Quota of one caller's calls, unless its token sets one. More than all other limits together
  /// permit, so that calls that begin or end also have room.
  std::uint32_t CallsOfOneCaller() const { return 4 * MaxOpeningCalls() + max_parts; }

  /// Maximum size of a serialised `open`: a checkpoint, and 64 KiB for its other fields.
  std::uint64_t MaxOpenBytes() const { return MaxCheckpointBytes() + kQuickOpenBytes; }

  /// Size of a frame of usual particles (three float64, id, volume, velocity: 44 bytes), with some
  /// reserve. Frames with many attributes need a larger limit.
  static constexpr std::uint64_t DefaultFrameBytes(std::uint64_t max_particles) {
    return 48 * max_particles + 4096;
  }
};

}  // namespace partiemc::server
