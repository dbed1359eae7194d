// A watcher of somebody else's stream: gets its results while they are made, and can never hold up
// whoever makes them.
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
#include "partiemc/client/credentials.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/client/stream.h"

namespace partiemc::client {

enum class WatchMode : std::uint8_t {
  kLatest,  ///< The newest frame whenever there is room for one; others are dropped and counted.
  kEvery,   ///< Every frame from now on; who falls behind for long is disconnected.
};

struct WatcherOptions {
  WatchMode mode = WatchMode::kLatest;
  /// Frames on their way or waiting to be received, at least 1. More hides a slow link; fewer show
  /// newer frames.
  std::uint32_t credits = 2;
  /// Goes back in the stream: the frames that the server still holds come first, from this sequence
  /// number on, 0: from the oldest; in their order, none left out in either mode. Then what comes
  /// live. One that is newer than all of them: that alone. Without it, from the newest frame on.
  std::optional<std::uint64_t> from_sequence = {};
  Credentials credentials = {};
  /// Servers where the stream may be, beside the one that Open is given.
  std::vector<std::string> fallback_addresses = {};
  /// How a watch goes on whose connection or server was lost, or whose stream was taken over or
  /// lost its producer: the stream is looked for at every address. In mode kEvery, and with
  /// from_sequence, it goes on after the last frame that was received, so that nothing is missed
  /// that the server still holds; else with the newest. `announce` is not used: frames tell.
  ReconnectPolicy rejoin = {.give_up_after = kShortPatience};
  /// For reaching the server; a server that starts meanwhile is found.
  std::chrono::milliseconds connect_timeout{2000};
  /// For the server to answer. Frames may take any time: they come when the producer sends them.
  std::chrono::milliseconds deadline{30000};
};

/// What a server holds of a stream for its watchers.
struct HeldFrames {
  std::uint64_t oldest_sequence = 0, newest_sequence = 0;
};

/// The stream that is watched.
struct WatchedStream {
  std::string stream_id;                ///< As in the server's log.
  ReconstructionParameters parameters;  ///< As resolved.
  std::map<std::string, std::string> labels;
  /// When the watch was opened or joined again; absent if there were no frames.
  std::optional<HeldFrames> held = {};
};

/// Kept by the caller and handed in again, so that its buffers are reused.
struct WatchedFrame {
  std::uint64_t sequence = 0;  ///< Of the producer's frame.
  double time = 0;
  FrameResult frame;
  /// x0, y0, x1, y1, ... in the stream's plane, where its producer echoes them; else empty.
  std::vector<double> particles;
  /// What else the producer sent of them, velocities as `particles`; each for all, or empty.
  std::vector<std::uint64_t> particle_ids;
  std::vector<float> particle_volumes, particle_velocities;
  std::uint64_t dropped = 0;  ///< Frames that did not come since the one before, as counted.
  /// Of the first frame after the watch had been lost and joined again: where, why and for how
  /// long, in one line; else empty.
  std::string rejoined;
  /// Then also the sequence numbers between the frame before and this one. Nobody has counted which
  /// of them were results and which were frames that the server refused; `dropped` is 0.
  std::uint64_t gap = 0;
  /// The oldest frame that WatcherOptions::from_sequence could still ask for when this one was
  /// sent; 0 from a server that knows no histories.
  std::uint64_t oldest_sequence = 0;
};

/// Why a watch ended.
struct WatchEnd {
  std::string reason;   ///< "FINISHED", "PRODUCER_LOST", ...: proto/PROTOCOL.md has the table.
  std::string message;  ///< For a person.
  std::uint64_t dropped = 0;  ///< Frames that did not come since the last one.
};

/// One thread receives; Cancel may come from any thread. Reading runs in the background, credit is
/// given as frames are received.
class Watcher {
 public:
  /// `stream_name` is as ListStreams tells it; `address` is HOST:PORT, [IPV6]:PORT or unix:PATH.
  /// Errors: INVALID_ARGUMENT (address, credentials), UNAVAILABLE (no server there, or one of the
  /// two does not trust the other), UNAUTHENTICATED (token), NOT_FOUND (no such stream
  /// at any address), RESOURCE_EXHAUSTED (too many watchers), DEADLINE_EXCEEDED, each in one line.
  static absl::StatusOr<std::unique_ptr<Watcher>> Open(std::string_view address,
                                                       std::string_view stream_name,
                                                       const WatcherOptions& options);

  /// Leaves unless the end has been received. No call may be under way.
  virtual ~Watcher() = default;

  virtual const WatchedStream& stream() const = 0;

  /// Waits for the next frame, at most `wait` where it is given. kEnd: the watch has ended, as
  /// end() tells.
  /// Sequence numbers rise, also where a resumed stream shows frames again.
  /// Errors: RESOURCE_EXHAUSTED (fell behind in mode kEvery; a frame too large to be watched),
  /// UNAVAILABLE (the server drains, or the connection was lost, and the stream was not found
  /// again), DATA_LOSS when a message makes no
  /// sense, CANCELLED after Cancel; each has ended the watch.
  virtual absl::StatusOr<Received> Receive(
      WatchedFrame& frame, std::optional<std::chrono::milliseconds> wait = std::nullopt) = 0;

  /// Once the watch has ended; what the server said of it, if it did.
  virtual const WatchEnd& end() const = 0;

  /// While the watch looks for its lost stream; the receiver's thread only.
  virtual std::optional<Reconnecting> reconnecting() const { return std::nullopt; }

  /// Leaves at once: calls under way and later ones return CANCELLED.
  virtual void Cancel() = 0;
};

}  // namespace partiemc::client
