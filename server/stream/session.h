// A stream as the method sees it: parameters that are fixed, a state that moves from frame to
// frame, and the rule that decides which frame may come next. Knows no messages and no threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/stage_clock.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/reconstructor.h"
#include "partiemc/result.h"
#include "partiemc/stage.h"
#include "partiemc/state.h"
#include "server/compute/worker.h"
#include "server/stream/checkpoint.h"

namespace partiemc::server {

/// The reasons that sessions give, beside the core's (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonSequenceGap = "SEQUENCE_GAP";
inline constexpr std::string_view kReasonSequenceDuplicate = "SEQUENCE_DUPLICATE";

/// RESOURCE_EXHAUSTED with the Violation of a frame, of size `value`, that memory is lacking for.
absl::Status OutOfMemory(std::string value);

/// Not thread-safe: one frame at a time, as the method needs it anyway.
class Session {
 public:
  /// Writes a result where its reader wants it. An error refuses the frame.
  using Deliver = absl::FunctionRef<absl::Status(const Result&, const StageClock&)>;

  /// Errors: those of Reconstructor::Create.
  static absl::StatusOr<Session> Open(const ReconstructionParameters& parameters,
                                      const FrameLimits& limits);

  /// Goes on after the frame that the checkpoint was made after, bit for bit as if the stream had
  /// never stopped.
  void GoOnFrom(Checkpoint checkpoint);

  /// What ParseCheckpoint takes, after the last frame. Costs and takes as much as the state. Empty
  /// where it might have more than `max_bytes`.
  std::string MakeCheckpoint(const StreamTerms& terms, const CheckpointKeys* keys,
                             std::uint64_t max_bytes) const;

  /// Reconstructs the frame and hands the result to `deliver`. `frame` is an error where the frame
  /// could not be decoded.
  /// Errors, each with a Violation, after which the state is as if the frame had never come:
  ///   a `sequence` other than next_sequence() (SEQUENCE_GAP, SEQUENCE_DUPLICATE) uses up nothing;
  ///   the error of `frame`, of the core or of `deliver`, or memory that ran out or that the worker
  ///   may not have (OUT_OF_MEMORY) uses up the sequence number;
  ///   CANCELLED, without a Violation, once `cancelled` is set (FrameControl), uses up nothing: the
  ///   same frame may come again.
  absl::Status Answer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame, Worker& worker,
                      Deliver deliver, const std::atomic<bool>* cancelled = nullptr);

  /// Refuses a frame whose number could not be read; it uses up none. Returns `why`.
  absl::Status Refuse(absl::Status why, Worker& worker) const;

  /// 1 for a new stream.
  std::uint64_t next_sequence() const { return next_sequence_; }
  /// As resolved.
  const ReconstructionParameters& parameters() const { return reconstructor_.parameters(); }

 private:
  explicit Session(Reconstructor reconstructor) : reconstructor_(std::move(reconstructor)) {}

  absl::Status TryAnswer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame, Worker& worker,
                         Deliver deliver, const std::atomic<bool>* cancelled);
  absl::Status Reconstruct(const Frame& frame, Worker& worker, Deliver deliver,
                           const std::atomic<bool>* cancelled);

  Reconstructor reconstructor_;
  State state_;
  std::uint64_t next_sequence_ = 1;
};

}  // namespace partiemc::server
