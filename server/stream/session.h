// Computes one stream: keeps its parameters and its state, and checks the sequence numbers.
// Includes no messages and starts no threads.
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
#include "server/compute/state_memory.h"
#include "server/compute/worker.h"
#include "server/stream/checkpoint.h"

namespace partiemc::server {

/// Reasons for which a session refuses a frame, in addition to the core's reasons
/// (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonSequenceGap = "SEQUENCE_GAP";
inline constexpr std::string_view kReasonSequenceDuplicate = "SEQUENCE_DUPLICATE";

/// RESOURCE_EXHAUSTED (OUT_OF_MEMORY): there is no memory for a frame. `value` states its size.
absl::Status OutOfMemory(std::string value);

/// Computes the frames of a stream, one at a time. Not thread-safe.
class Session {
 public:
  /// Function that writes a result into the response. If it returns an error, the frame is refused.
  using Deliver = absl::FunctionRef<absl::Status(const Result&, const StageClock&)>;

  /// `memory` counts the state between frames. Errors: as Reconstructor::Create.
  static absl::StatusOr<Session> Open(const ReconstructionParameters& parameters,
                                      const FrameLimits& limits, StateMemory::Account memory = {});

  /// Continues the stream of the checkpoint. The results are bit-identical to the results of an
  /// uninterrupted stream. Errors: as StateMemory::Account::Grow.
  absl::Status GoOnFrom(Checkpoint checkpoint);

  /// Serialises the state after the last frame (see Serialize in checkpoint.h). Returns no bytes if
  /// the checkpoint might exceed `max_bytes`. Cost and size are proportional to the state.
  std::string MakeCheckpoint(const StreamTerms& terms, const CheckpointKeys* keys,
                             std::uint64_t max_bytes) const;

  /// Reconstructs the frame and passes the result to `deliver`. `frame` is an error if decoding
  /// failed.
  ///
  /// An error leaves the state unchanged. Every error except CANCELLED has a Violation:
  /// - SEQUENCE_GAP, SEQUENCE_DUPLICATE: `sequence` is not next_sequence(). The expected number
  ///   stays the same.
  /// - OUT_OF_MEMORY, MEMORY_BUDGET (the state is too large), and errors of `frame`, of the core or
  ///   of `deliver`: the frame uses up its number, so next_sequence() increases.
  /// - CANCELLED: `cancelled` was set (FrameControl). next_sequence() stays the same, so that the
  ///   client may send the frame again.
  absl::Status Answer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame, Worker& worker,
                      Deliver deliver, const std::atomic<bool>* cancelled = nullptr);

  /// Refuses a frame whose sequence number could not be decoded; reports the refusal to the
  /// observer of `worker` and returns `why`. next_sequence() stays the same.
  absl::Status Refuse(absl::Status why, Worker& worker) const;

  /// The sequence number that the next frame must have; 1 for a new stream.
  std::uint64_t next_sequence() const { return next_sequence_; }
  /// With defaults resolved.
  const ReconstructionParameters& parameters() const { return reconstructor_.parameters(); }

 private:
  Session(Reconstructor reconstructor, StateMemory::Account memory)
      : reconstructor_(std::move(reconstructor)), state_memory_(std::move(memory)) {}

  absl::Status TryAnswer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame, Worker& worker,
                         Deliver deliver, const std::atomic<bool>* cancelled);
  absl::Status Reconstruct(const Frame& frame, Worker& worker, Deliver deliver,
                           const std::atomic<bool>* cancelled);

  Reconstructor reconstructor_;
  StateMemory::Account state_memory_;
  State state_;
  std::uint64_t next_sequence_ = 1;
};

}  // namespace partiemc::server
