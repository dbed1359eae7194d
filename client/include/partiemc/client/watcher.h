// Receives the results of another client's stream while they are computed. A watcher never delays
// the producer.
//
//   auto watcher = partiemc::client::Watcher::Open("127.0.0.1:50051", "dam-break", {});
//   if (!watcher.ok()) ...
//   partiemc::client::WatchedFrame frame;
//   for (auto got = (*watcher)->Receive(frame); got.ok() && *got == Received::kEvent;
//        got = (*watcher)->Receive(frame)) Draw(frame.frame.result.rings);
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/attribute_values.h"
#include "partiemc/client/credentials.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/client/stream.h"
#include "partiemc/surface_level.h"

namespace partiemc::client {

enum class WatchMode : std::uint8_t {
  kLatest,  ///< The newest frame when a credit is free; older ones are dropped and counted.
  kEvery,   ///< Every frame; a slow watcher is disconnected.
};

struct WatcherOptions {
  WatchMode mode = WatchMode::kLatest;
  /// Number of frames that may be on the way or waiting to be received, at least 1. More credits
  /// hide a slow connection; with fewer credits the received frames are newer.
  std::uint32_t credits = 2;
  /// First frame to receive: this sequence number, or the oldest frame of the server's history if
  /// that is newer. In either mode, frames of the history come in order and without gaps; live
  /// frames follow. If the whole history is older than this number, only live frames are received.
  /// Absent: starts with the newest frame.
  std::optional<std::uint64_t> from_sequence = {};
  /// For streams of surfaces: receive simplified surfaces. Absent: exact ones. Servers without the
  /// capability "surface-levels" send exact ones, too.
  std::optional<LevelOfDetail> level_of_detail = {};
  Credentials credentials = {};
  /// Servers where the stream may be, in addition to the address of Open.
  std::vector<std::string> fallback_addresses = {};
  /// How a watch continues after it lost its connection or server, or after its stream was taken
  /// over or lost its producer. The watch looks for the stream at every address. In mode kEvery, or
  /// with from_sequence, it continues after the last received frame and misses no frame of the
  /// server's history. Otherwise it continues with the newest frame. `announce` is not used,
  /// because WatchedFrame reports a loss.
  ReconnectPolicy rejoin = {.give_up_after = kShortPatience};
  /// Maximum time to reach the server. It includes the wait for a server that is still starting.
  /// The first connection divides it among the addresses. When the watch rejoins, each attempt has
  /// this time to be accepted.
  std::chrono::milliseconds connect_timeout{2000};
  /// Maximum time for a server to accept the watcher in Open. Frames have no timeout: they depend
  /// on the producer.
  std::chrono::milliseconds deadline{30000};
};

/// Range of frames in the server's history of a stream.
struct HeldFrames {
  std::uint64_t oldest_sequence = 0, newest_sequence = 0;
};

/// The watched stream.
struct WatchedStream {
  std::string stream_id;                ///< The id in the server's log.
  ReconstructionParameters parameters;  ///< Resolved.
  std::map<std::string, std::string> labels;
  /// The history when the watch was opened or rejoined; absent if it was empty.
  std::optional<HeldFrames> held = {};
};

/// One received frame. The caller keeps the object and passes it again, so that its buffers are
/// reused.
struct WatchedFrame {
  std::uint64_t sequence = 0;  ///< Number of the producer's frame.
  double time = 0;
  FrameResult frame;
  /// Set if the surface is a level of detail. Statistics, digests, measures and identities describe
  /// the exact surface.
  std::optional<SurfaceLevel> level;
  /// x0, y0, x1, y1, ... in the stream's plane, or x0, y0, z0, ... if the stream has surfaces;
  /// empty unless the producer echoes its particles.
  std::vector<double> particles;
  /// Ids, volumes and velocities of the echoed particles; empty if the producer sends none.
  /// Velocities have the layout of `particles`.
  std::vector<std::uint64_t> particle_ids;
  std::vector<float> particle_volumes, particle_velocities;
  /// The attributes that the producer sends with its echoed particles, such as phases: `components`
  /// values per particle, distinct names.
  std::vector<AttributeValues> particle_attributes;
  /// The periodic box of the frame, along the axes of `particles`. Absent without particles.
  std::optional<PeriodicBox> particle_box;
  std::uint64_t dropped = 0;  ///< Frames dropped since the previous received frame.
  /// Set for the first frame after a loss: one line with the lost address, the cause, the address
  /// where the watch continues, and the duration. Otherwise empty.
  std::string rejoined;
  /// Set together with `rejoined`: number of sequence numbers between the previous frame and this
  /// one. They belong to missed results and to refused frames. `dropped` is then 0. Without a
  /// previous frame, `gap` is 0 and `dropped` counts the dropped frames.
  std::uint64_t gap = 0;
  /// The oldest frame that WatcherOptions::from_sequence could request when this one was sent; 0 if
  /// the server has no histories.
  std::uint64_t oldest_sequence = 0;
};

/// The server's reason for the end of a watch.
struct WatchEnd {
  std::string reason;   ///< "FINISHED", "PRODUCER_LOST", ...; see the table in proto/PROTOCOL.md.
  std::string message;  ///< One line for people.
  std::uint64_t dropped = 0;  ///< Frames dropped since the last received one.
};

/// One thread receives; any thread may call Cancel. Messages are read in the background. Receiving
/// a frame returns its credit to the server.
class Watcher {
 public:
  /// `stream_name` is a name from ListStreams; `address` is HOST:PORT, [IPV6]:PORT or unix:PATH.
  /// Errors: INVALID_ARGUMENT (address, credentials), UNAVAILABLE (no server, or TLS verification
  /// failed), UNAUTHENTICATED (token), NOT_FOUND (no such stream at any address),
  /// RESOURCE_EXHAUSTED (too many watchers or levels of detail), DEADLINE_EXCEEDED. Each message is
  /// one line.
  static absl::StatusOr<std::unique_ptr<Watcher>> Open(std::string_view address,
                                                       std::string_view stream_name,
                                                       const WatcherOptions& options);

  /// Cancels the watch unless its end has been received. No call may be in progress.
  virtual ~Watcher() = default;

  virtual const WatchedStream& stream() const = 0;

  /// Waits for the next frame, at most `wait` if given. kEnd: the watch has ended; see end().
  /// Sequence numbers increase, even if a resumed stream repeats frames.
  /// Errors: RESOURCE_EXHAUSTED (too slow in mode kEvery, or a frame too large for watchers),
  /// UNAVAILABLE (the server drains or the connection was lost, and the stream was not found
  /// again), DATA_LOSS (a malformed message), CANCELLED after Cancel. Each error ends the watch.
  virtual absl::StatusOr<Received> Receive(
      WatchedFrame& frame, std::optional<std::chrono::milliseconds> wait = std::nullopt) = 0;

  /// Valid after the watch has ended; empty if the server sent no reason.
  virtual const WatchEnd& end() const = 0;

  /// Set while the watch looks for its stream after a loss. Receiver's thread only.
  virtual std::optional<Reconnecting> reconnecting() const { return std::nullopt; }

  /// Ends the watch at once: current and later calls return CANCELLED. If Receive has already
  /// reported the end of the watch, later calls report the same end.
  virtual void Cancel() = 0;
};

}  // namespace partiemc::client
