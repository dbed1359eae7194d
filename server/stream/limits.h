// The limits of a server. StreamOpened and GetServerInfo announce most of them to clients.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>

#include "partiemc/frame.h"
#include "server/stream/stream_state_machine.h"
#include "server/stream/unary_state_machine.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

/// MemoryPlan computes the server's maximum memory from these limits. Among its terms are:
/// - `memory_budget` for requests, responses, workers and histories;
/// - frames beyond the budget (ReadBytesBeyond);
/// - the worker that computes a frame beyond the budget (WorkerBytesBeyond);
/// - the states of streams between their frames (StateBytes);
/// - 16 MiB of buffers for each compute thread, which do not count in the budget.
struct ServerLimits {
  /// Limits of one frame. Larger simulations need higher limits; memory grows with them.
  FrameLimits frame{.max_particles = 4'000'000, .max_tiles = 131'072};

  /// Maximum size of a serialised ParticleFrame. By default the command line sets
  /// DefaultFrameBytes(frame.max_particles), but at most an eighth of the memory budget (4 MiB if
  /// an eighth is less), and at most 1.7 GB, so that gRPC can receive a message a quarter larger.
  std::uint64_t max_frame_bytes = DefaultFrameBytes(4'000'000);

  /// Maximum size of a client's message. A larger message ends the stream. The limit exceeds the
  /// announced `max_frame_bytes` by a quarter. So a frame that is slightly too large gets a
  /// FrameError, and the stream continues.
  std::uint64_t MaxMessageBytes() const {
    return std::min<std::uint64_t>(max_frame_bytes + max_frame_bytes / 4,
                                   std::numeric_limits<std::int32_t>::max());
  }

  /// Maximum size of a checkpoint, sent or received. A resuming client sends its checkpoint in
  /// `open`, so this limit keeps `open` as small as a frame. A state has one or two bytes for each
  /// particle of a compact body. It has 370 or more for an isolated particle, and 32 to 44 for each
  /// particle of a stream with a noise filter. Therefore the limits of tiles and particles would
  /// permit states larger than any message.
  std::uint64_t MaxCheckpointBytes() const { return max_frame_bytes; }

  /// Maximum number of open streams. The same number limits the concurrent calls of
  /// ReconstructFrame of one caller. All callers together get twice the number (UnaryRegistry).
  std::uint32_t max_streams = 32;

  /// Maximum number of frames of one stream that the server holds. A frame counts from the start of
  /// its read to the end of its response's write. Two suffice for large frames, four for small
  /// ones; more only costs memory.
  std::uint32_t frames_in_flight = 4;

  /// Bytes that requests, responses, workers and histories may hold together. While the budget is
  /// exhausted, a stream reads only if it has no frame in flight and gets a slot for a frame beyond
  /// the budget. Servers with several large streams need a larger budget.
  std::uint64_t memory_budget = std::uint64_t{1} << 30;

  /// Maximum number of streams that may hold a frame beyond the budget at once; at least 1.
  std::uint32_t streams_beyond_budget = 2;

  /// Maximum size of all frames beyond the budget: one message for each such stream. If frames
  /// arrive in parts, two messages, because part 0 is counted separately from the other parts.
  std::uint64_t ReadBytesBeyond() const {
    return streams_beyond_budget * (max_parts > 0 ? 2 : 1) * MaxMessageBytes();
  }
  /// Maximum size of the one worker that computes beyond the budget: its buffers for a compact body
  /// with the maximum number of particles.
  std::uint64_t WorkerBytesBeyond() const {
    const std::uint64_t most =
        std::min<std::uint64_t>(frame.max_particles, max_frame_bytes / kLeastBytesOfParticle);
    return kBytesOfCompactParticle * most;
  }
  /// Minimum bytes of a particle in a message: two float32 coordinates.
  static constexpr std::uint64_t kLeastBytesOfParticle = 8;
  /// Bytes that a worker needs for each particle of a compact body: 60 bytes, and the particle's
  /// share of the tiles (core/src/workspace_bytes.h).
  static constexpr std::uint64_t kBytesOfCompactParticle = 80;

  /// Maximum size of one stream's history, including an overhead of 512 bytes for each result. 0:
  /// streams have no history.
  std::uint64_t history_bytes = std::uint64_t{64} << 20;

  /// Maximum size of all histories together, at most an eighth of the budget; streams share it
  /// equally. This part of the budget is reserved, so that no frame waits for memory that old
  /// results hold.
  std::uint64_t AllHistoryBytes() const {
    const std::uint64_t most = memory_budget / 8;
    return history_bytes <= most / std::max(1u, max_streams) ? history_bytes * max_streams : most;
  }
  /// The budget without the histories.
  std::uint64_t FrameBudget() const { return memory_budget - AllHistoryBytes(); }

  /// Memory that is reserved for the state of each stream. Ordinary states are smaller. Larger
  /// states also use SharedStateBytes.
  static constexpr std::uint64_t kOwnStateBytes = 64 << 10;
  /// Maximum size of the states of all streams between their frames, outside of the budget: a
  /// quarter of it, but at least kOwnStateBytes for each stream.
  std::uint64_t StateBytes() const {
    return std::max<std::uint64_t>(memory_budget / 4, max_streams * kOwnStateBytes);
  }
  /// The part of StateBytes that larger states share.
  std::uint64_t SharedStateBytes() const { return StateBytes() - max_streams * kOwnStateBytes; }

  /// An idle stream costs little memory except for its state, but it occupies a name and a slot.
  IdleLimits idle{.opening = std::chrono::seconds(30), .streaming = std::chrono::hours(1)};

  /// Limits of unary calls. A response that the client does not receive in time is dropped, because
  /// it holds memory.
  UnaryLimits unary{.request = std::chrono::seconds(30), .answer = std::chrono::minutes(2)};

  /// Limits of watchers of ended streams, because such a watcher keeps the stream's history. The
  /// time of a write includes the wait for a level of detail.
  PauseLimits paused{.pause = std::chrono::minutes(10), .write = std::chrono::minutes(2)};

  /// Maximum number of watchers of all streams together.
  std::uint32_t max_watchers = 64;

  /// Maximum number of parts of a frame. The same number limits, for all streams together, the
  /// calls that send parts 1 and above. 0: the server accepts whole frames only.
  std::uint32_t max_parts = 256;

  /// Maximum memory that one watcher can pin: the results that it has not received yet. It usually
  /// shares them with other watchers. A larger result ends the watch.
  std::uint64_t max_watcher_bytes = std::uint64_t{16} << 20;

  /// A stream's last result is kept for new watchers if it is at most this large: 64 MiB divided by
  /// the maximum number of streams.
  std::uint64_t KeptResultBytes() const { return (std::uint64_t{64} << 20) / max_streams; }

  /// Maximum memory of the levels of detail that are kept for watchers of the same frame, outside
  /// of the budget: a 32nd of the budget.
  std::uint64_t LevelBytes() const { return memory_budget / 32; }

  /// Maximum number of opening calls, which have not sent their first request; for all methods
  /// together.
  std::uint32_t MaxOpeningCalls() const { return std::max(64u, max_streams + max_watchers); }

  /// Quota of concurrent calls of one caller, unless its token sets another quota. It exceeds the
  /// sum of all other limits, so that calls that are beginning or ending also fit.
  std::uint32_t CallsOfOneCaller() const { return 4 * MaxOpeningCalls() + max_parts; }

  /// Maximum size of a serialised `open`: a checkpoint plus 64 KiB for the other fields.
  std::uint64_t MaxOpenBytes() const { return MaxCheckpointBytes() + kQuickOpenBytes; }

  /// Size of a frame with the usual data of a particle plus 4 KiB for other fields. The usual data
  /// are three float64, id, volume and three float32 of velocity: 48 bytes. Frames with more
  /// attributes need a larger limit.
  static constexpr std::uint64_t DefaultFrameBytes(std::uint64_t max_particles) {
    return 48 * max_particles + 4096;
  }
};

}  // namespace partiemc::server
