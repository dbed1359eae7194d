#include "server/stream/session.h"

#include <new>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

// Passes the core's requests for memory, made while it computes one frame, to the memory account of
// the worker.
class FrameMemory final : public MemoryGuard {
 public:
  /// `state_bytes`: size of the stream's state.
  FrameMemory(WorkerMemory& account, std::size_t particles, std::uint64_t state_bytes)
      : account_(account), particles_(particles), state_bytes_(state_bytes) {}
  bool Reserve(std::uint64_t bytes) override {
    // Also reserves memory for two states: Worker::next_state, and its copy that becomes the state
    // of the stream.
    return account_.Reserve(bytes + 2 * state_bytes_, particles_, 2 * state_bytes_);
  }

 private:
  WorkerMemory& account_;
  const std::size_t particles_;
  const std::uint64_t state_bytes_;
};

}  // namespace

absl::Status OutOfMemory(std::string value) {
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonOutOfMemory), "frame", std::move(value),
       "must fit into the server's memory; send a smaller frame or try again later"});
}

absl::StatusOr<Session> Session::Open(const ReconstructionParameters& parameters,
                                      const FrameLimits& limits, StateMemory::Account memory) {
  auto reconstructor = Reconstructor::Create(parameters, limits);
  if (!reconstructor.ok()) return reconstructor.status();
  return Session(*std::move(reconstructor), std::move(memory));
}

absl::Status Session::GoOnFrom(Checkpoint checkpoint) {
  if (auto status = state_memory_.Grow(SerializedBytes(checkpoint.state)); !status.ok()) {
    return status;
  }
  next_sequence_ = checkpoint.next_sequence;
  state_ = std::move(checkpoint.state);
  return absl::OkStatus();
}

std::string Session::MakeCheckpoint(const StreamTerms& terms, const CheckpointKeys* keys,
                                    std::uint64_t max_bytes) const {
  if (SerializedBytes(state_) + kMaxCheckpointOverhead > max_bytes) return {};
  return Serialize(next_sequence_, state_, parameters(), terms, keys);
}

absl::Status Session::Answer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame,
                             Worker& worker, Deliver deliver, const std::atomic<bool>* cancelled) {
  absl::Status status = TryAnswer(sequence, frame, worker, deliver, cancelled);
  if (absl::IsCancelled(status)) {
    --next_sequence_;
    worker.Empty();
    return status;
  }
  return status.ok() ? status : Refuse(std::move(status), worker);
}

absl::Status Session::Refuse(absl::Status why, Worker& worker) const {
  if (worker.observer != nullptr) {
    const auto violation = FindViolation(why);
    worker.observer->FrameRefused(violation ? std::string_view(violation->reason) : "INTERNAL");
  }
  return why;
}

absl::Status Session::TryAnswer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame,
                                Worker& worker, Deliver deliver,
                                const std::atomic<bool>* cancelled) {
  if (sequence != next_sequence_) {
    const bool gap = sequence > next_sequence_;
    return ViolationError(
        absl::StatusCode::kInvalidArgument,
        {std::string(gap ? kReasonSequenceGap : kReasonSequenceDuplicate), "sequence",
         absl::StrCat(sequence),
         absl::StrCat("must be ", next_sequence_,
                      gap ? "; a frame before it is missing" : "; this number has been used")});
  }
  ++next_sequence_;
  if (!frame.ok()) return frame.status();
  try {
    return Reconstruct(*frame, worker, deliver, cancelled);
  } catch (const std::bad_alloc&) {
    worker.Empty();
    return OutOfMemory(absl::StrCat(frame->ParticleCount(), " particles"));
  }
}

absl::Status Session::Reconstruct(const Frame& frame, Worker& worker, Deliver deliver,
                                  const std::atomic<bool>* cancelled) {
  worker.particles.Used(frame.ParticleCount(), WarmSize::Clock::now());
  // Computes with a copy of the state. The core commits an accepted frame to the state that it
  // receives, but `deliver` may still refuse the frame.
  worker.next_state = state_;
  StageClock clock;
  const std::uint64_t state_bytes = SerializedBytes(state_);
  FrameMemory memory(worker.memory, frame.ParticleCount(), state_bytes);
  absl::Status status =
      reconstructor_.Reconstruct(frame, worker.next_state, worker.workspace, worker.result,
                                 {.observer = &clock, .memory = &memory, .cancelled = cancelled});
  const std::uint64_t next_bytes = status.ok() ? SerializedBytes(worker.next_state) : 0;
  if (status.ok()) status = state_memory_.Grow(next_bytes);
  if (status.ok()) status = deliver(worker.result, clock);
  if (!status.ok()) {
    state_memory_.Shrink(state_bytes);
    return status;
  }
  // Copies the new state instead of moving it. The worker's buffers have the capacity of the
  // largest stream that the worker has computed; a move would give this capacity to the stream. If
  // the allocation fails, the stream's state is unchanged.
  State next = worker.next_state;
  state_ = std::move(next);
  state_memory_.Shrink(next_bytes);
  if (worker.observer != nullptr) {
    worker.observer->FrameReconstructed(frame.ParticleCount(), clock);
  }
  return status;
}

}  // namespace partiemc::server
