// A stream of frames in, a stream of answers out: what a server's stream (stream.h) and the core
// in this process (local_stream.h) have in common.
//
// Frames are numbered from 1 as they are sent, and answered one by one in that order. One thread
// sends and another one receives; Cancel may come from any thread. A program with one thread
// receives before it sends whenever InFlight() has reached info().frames_in_flight.
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

/// Wall-clock milliseconds of each stage, in their order, and of the whole frame.
struct FrameTimes {
  std::array<double, kStageCount> stages_ms{};
  double total_ms = 0;
};

/// What an answered frame became.
struct FrameResult {
  Result result;  ///< Parts that were not asked for are empty.
  FrameTimes times;
  std::uint64_t rings_digest = 0;                    ///< DigestRings of the whole result.
  std::uint64_t mesh_digest = 0;                     ///< DigestMesh of the whole result.
  std::vector<OutlineDigests> section_digests = {};  ///< The same of each of result.sections.
};

/// One answer. Kept by the caller and handed in again, so that its buffers are reused.
struct Event {
  enum class Kind : std::uint8_t {
    kResult,       ///< `frame` holds what frame `sequence` became.
    kRefusal,      ///< Frame `sequence` broke `violation`; it left no trace, the stream goes on.
    kNotice,       ///< `message` is a word from the server (it is about to go away).
    kReconnected,  ///< The stream goes on after a loss that `message` tells; nothing is missing.
    kPartTaken,    ///< Part of frame `sequence`, which part 0 has the answer for (StreamOptions).
  };
  Kind kind = Kind::kResult;
  std::uint64_t sequence = 0;  ///< 0 for what is of no frame.
  double time = 0;             ///< Of a result: simulation time as it was sent.
  FrameResult frame;
  Violation violation;
  std::string message;  ///< Of all but a result and a part: one line for a person.
};

/// What a frame may cost; a larger one is refused.
struct StreamLimits {
  std::uint64_t max_particles_per_frame = 0;
  std::uint64_t max_frame_bytes = 0;  ///< Of one serialised frame; 0: no limit.
  std::uint64_t max_tiles_per_frame = 0;
};

/// What was agreed when the stream was opened.
struct StreamInfo {
  std::string stream_id;                ///< As in the server's log; empty in process.
  ReconstructionParameters parameters;  ///< As resolved; `spacing` absent where it is estimated.
  std::size_t frames_in_flight = 1;     ///< Frames that may be sent and not yet received.
  StreamLimits limits;
};

/// The search for a server after a loss.
struct Reconnecting {
  std::string loss;                            ///< Where and why: "lost HOST:PORT (WHY)".
  std::string refusal;                         ///< What came of the last attempt, in one line.
  std::chrono::milliseconds elapsed{0};        ///< Since the loss.
  std::chrono::milliseconds give_up_after{0};  ///< ReconnectPolicy::give_up_after.
};

enum class Received : std::uint8_t {
  kEvent,       ///< The event was filled.
  kNothingYet,  ///< The time to wait is over, nothing has come.
  kEnd,         ///< FinishSending was called and every frame has been answered.
};

class FrameStream {
 public:
  virtual ~FrameStream() = default;

  virtual const StreamInfo& info() const = 0;

  /// Sends one frame and returns its number. `frame` is copied or serialised before the call
  /// returns; its time is `time`, whatever Frame::time says. Waits while `frames_in_flight` frames
  /// are sent and not yet received. Errors: one that carries a Violation (FindViolation) refuses
  /// this frame alone, uses up no number, and the stream goes on; any other has ended the stream.
  /// FAILED_PRECONDITION after FinishSending. DEADLINE_EXCEEDED when the wait lasts longer than the
  /// stream's deadline; with a Violation (reason SEND_TIMEOUT) when it lasts longer than its
  /// `send_timeout`.
  virtual absl::StatusOr<std::uint64_t> Send(const Frame& frame, double time) = 0;

  /// The same of arrays that lie anywhere. Errors: also INVALID_ARGUMENT with a Violation (reason
  /// COUNT) for a coordinate that is missing.
  virtual absl::StatusOr<std::uint64_t> SendArrays(const ParticleArrays& particles,
                                                   double time) = 0;

  /// No more frames will come; answers to those sent are still to be received.
  virtual absl::Status FinishSending() = 0;

  /// Waits for the next answer, at most `wait` where it is given.
  /// Errors: whatever ended the stream. DEADLINE_EXCEEDED when a frame stays unanswered for the
  /// stream's deadline, DATA_LOSS when an answer makes no sense; both end the stream.
  virtual absl::StatusOr<Received> Receive(
      Event& event, std::optional<std::chrono::milliseconds> wait = std::nullopt) = 0;

  /// While the stream looks for a server, having lost one; the receiver's thread only.
  virtual std::optional<Reconnecting> reconnecting() const { return std::nullopt; }

  /// Frames sent and not yet received.
  virtual std::size_t InFlight() const = 0;

  /// Ends the stream at once: calls under way and later ones return CANCELLED.
  virtual void Cancel() = 0;
};

}  // namespace partiemc::client
