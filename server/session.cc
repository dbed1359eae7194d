#include "server/session.h"

#include <new>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/checkpoint.h"

namespace partiemc::server {

absl::Status OutOfMemory(std::string value) {
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonOutOfMemory), "frame", std::move(value),
       "must fit into the server's memory; send a smaller frame or try again later"});
}

absl::StatusOr<Session> Session::Open(const ReconstructionParameters& parameters,
                                      const FrameLimits& limits) {
  auto reconstructor = Reconstructor::Create(parameters, limits);
  if (!reconstructor.ok()) return reconstructor.status();
  return Session(*std::move(reconstructor));
}

absl::StatusOr<Session> Session::Resume(const ReconstructionParameters& parameters,
                                        const FrameLimits& limits, std::string_view checkpoint) {
  auto session = Open(parameters, limits);
  if (!session.ok()) return session;
  auto restored = ParseCheckpoint(checkpoint, session->parameters());
  if (!restored.ok()) return restored.status();
  session->next_sequence_ = restored->next_sequence;
  session->state_ = std::move(restored->state);
  return session;
}

std::string Session::Checkpoint() const {
  return Serialize(server::Checkpoint{next_sequence_, state_}, parameters());
}

absl::Status Session::Answer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame,
                             Worker& worker, Deliver deliver) {
  absl::Status status = TryAnswer(sequence, frame, worker, deliver);
  if (!status.ok() && worker.observer != nullptr) {
    const auto violation = FindViolation(status);
    worker.observer->FrameRefused(violation ? std::string_view(violation->reason) : "INTERNAL");
  }
  return status;
}

absl::Status Session::TryAnswer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame,
                                Worker& worker, Deliver deliver) {
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
    return Reconstruct(*frame, worker, deliver);
  } catch (const std::bad_alloc&) {
    // What the workspace holds is anybody's guess now, and its memory is wanted.
    worker = Worker{.observer = worker.observer};
    return OutOfMemory(absl::StrCat(frame->ParticleCount(), " particles"));
  }
}

absl::Status Session::Reconstruct(const Frame& frame, Worker& worker, Deliver deliver) {
  worker.particles.Used(frame.ParticleCount(), WarmSize::Clock::now());
  // The core commits a frame that it accepts, but `deliver` may still refuse it: work on a copy.
  worker.next_state = state_;
  StageClock clock;
  absl::Status status =
      reconstructor_.Reconstruct(frame, worker.next_state, worker.workspace, worker.result, &clock);
  if (status.ok()) status = deliver(worker.result, clock);
  if (!status.ok()) return status;
  // Another copy: the worker's own has room for the largest stream that it served, which would pass
  // from stream to stream. Memory that runs out here leaves the state as it was.
  State next = worker.next_state;
  state_ = std::move(next);
  if (worker.observer != nullptr) {
    worker.observer->FrameReconstructed(frame.ParticleCount(), clock);
  }
  return status;
}

}  // namespace partiemc::server
