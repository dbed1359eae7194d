// Interface of a stream of frames. Implemented by a connection to a server (stream.h) and by the
// core in this process (local_stream.h).
//
// Frames are numbered from 1 in the order of sending. Each frame is answered once, in the same
// order. One thread sends, another receives; any thread may call Cancel. A program with one thread
// must receive before it sends when InFlight() has reached info().frames_in_flight.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/particle_arrays.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "partiemc/stage.h"
#include "partiemc/status.h"

namespace partiemc::client {

/// Wall-clock milliseconds of each stage, in stage order, and of the whole frame.
struct FrameTimes {
  std::array<double, kStageCount> stages_ms{};
  double total_ms = 0;
};

/// The result of one frame.
struct FrameResult {
  Result result;  ///< Outputs that were not requested are empty.
  FrameTimes times;
  // Digests of the geometry in float64. They do not depend on Outputs:
  std::uint64_t rings_digest = 0;                    ///< DigestRings.
  std::uint64_t mesh_digest = 0;                     ///< DigestMesh.
  std::uint64_t surface_digest = 0;                  ///< DigestSurface.
  std::vector<OutlineDigests> section_digests = {};  ///< One for each of result.sections.
};

/// One event of a stream. The caller keeps the object and passes it again, so that its buffers are
/// reused.
struct Event {
  enum class Kind : std::uint8_t {
    kResult,   ///< `frame` holds the result of frame `sequence`.
    kRefusal,  ///< Frame `sequence` broke `violation` and changed nothing. The stream continues.
    kNotice,   ///< `message` is a notice from the server, for example that it drains. Delivered
               ///< only by streams that do not reconnect.
    kReconnected,  ///< The stream continues after the loss that `message` describes. Nothing is
                   ///< missing.
    kPartTaken,    ///< A part of frame `sequence` was accepted. Part 0 receives the result.
  };
  Kind kind = Kind::kResult;
  std::uint64_t sequence = 0;  ///< 0 if the event belongs to no frame.
  double time = 0;             ///< Simulation time of the frame; set for results.
  FrameResult frame;
  Violation violation;
  std::string message;  ///< One line for people; not set for results and parts.
};

/// Limits of the server for one frame; 0: no limit. Send refuses a frame with too many particles or
/// bytes. The server refuses a frame with too many tiles.
struct StreamLimits {
  std::uint64_t max_particles_per_frame = 0;
  std::uint64_t max_frame_bytes = 0;  ///< Bytes of one serialised frame.
  std::uint64_t max_tiles_per_frame = 0;
};

/// Settings of an open stream.
struct StreamInfo {
  std::string stream_id;                ///< The first FrameStream::CurrentId().
  ReconstructionParameters parameters;  ///< Resolved; `spacing` is absent if it is estimated.
  std::size_t frames_in_flight = 1;  ///< Capacity of the window: frames sent and not yet answered.
  StreamLimits limits;
  bool frame_boxes = true;  ///< The server uses Frame::box; Send refuses a box otherwise.
};

/// Progress of reconnecting after a loss.
struct Reconnecting {
  std::string loss;                            ///< "lost HOST:PORT (WHY)".
  std::string refusal;                         ///< Error of the last attempt, in one line.
  std::chrono::milliseconds elapsed{0};        ///< Time since the loss.
  std::chrono::milliseconds give_up_after{0};  ///< ReconnectPolicy::give_up_after.
};

enum class Received : std::uint8_t {
  kEvent,       ///< The event was filled.
  kNothingYet,  ///< `wait` has passed without an event.
  kEnd,         ///< Stream: after FinishSending, every frame has been answered. Watcher: the watch
                ///< has ended.
};

class FrameStream {
 public:
  virtual ~FrameStream() = default;

  virtual const StreamInfo& info() const = 0;

  /// The id of the stream in the log of its server and in ListStreams; empty in process. Each
  /// reconnection gives the stream a new id. Until Receive has reconnected, it is the id before the
  /// loss. Any thread.
  virtual std::string CurrentId() const { return info().stream_id; }

  /// Sends one frame and returns its number. `frame` is copied or serialised before the call
  /// returns. `time` replaces Frame::time. Waits while the window is full.
  /// Errors: a status with a Violation (FindViolation) refuses only this frame; the frame gets no
  /// number, and the stream continues. After FinishSending, Send returns FAILED_PRECONDITION, and
  /// the stream continues too. Any other status ended the stream.
  /// If the wait exceeds `send_timeout`, Send returns DEADLINE_EXCEEDED with a Violation (reason
  /// SEND_TIMEOUT). If it exceeds StreamOptions::deadline, DEADLINE_EXCEEDED ends the stream.
  virtual absl::StatusOr<std::uint64_t> Send(const Frame& frame, double time) = 0;

  /// Same as Send for arrays with arbitrary strides. Errors: also INVALID_ARGUMENT with a Violation
  /// if a component is missing (reason COUNT) or the time is not finite (NOT_FINITE).
  virtual absl::StatusOr<std::uint64_t> SendArrays(const ParticleArrays& particles,
                                                   double time) = 0;

  /// Declares that no frame follows. Results of frames already sent are still received.
  virtual absl::Status FinishSending() = 0;

  /// Waits for the next event, at most `wait` if given.
  /// Errors: the status that ended the stream. DEADLINE_EXCEEDED if a frame is not answered within
  /// StreamOptions::deadline, DATA_LOSS if a response is malformed; both end the stream.
  virtual absl::StatusOr<Received> Receive(
      Event& event, std::optional<std::chrono::milliseconds> wait = std::nullopt) = 0;

  /// Set while the stream reconnects after a loss. Receiver's thread only.
  virtual std::optional<Reconnecting> reconnecting() const { return std::nullopt; }

  /// Number of frames sent whose answer has not been received.
  virtual std::size_t InFlight() const = 0;

  /// Ends the stream at once: current and later calls return CANCELLED. If the stream had already
  /// ended with an error, calls return this error.
  virtual void Cancel() = 0;
};

}  // namespace partiemc::client
