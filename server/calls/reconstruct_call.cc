#include "server/calls/reconstruct_call.h"

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "partiemc/status.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

void LogEnd(const std::optional<StreamSummary>& stream, const std::string& peer,
            const absl::Status& status) {
  if (!stream) {
    LogRefusal("stream refused", peer, status);
    return;
  }
  const auto violation = FindViolation(status);
  const std::chrono::duration<double> open = std::chrono::steady_clock::now() - stream->opened;
  LogEvent(spdlog::level::info, "stream closed",
           {{"id", stream->id},
            {"name", stream->description.name},
            {"frames", stream->counts.frames},
            {"frame_errors", stream->counts.frame_errors},
            {"watch_waits", stream->description.broadcaster->producer_waits()},
            {"seconds", open.count()},
            {"status", absl::StatusCodeToString(status.code())},
            {"reason", violation ? violation->reason : std::string()}});
}

void LogPartEnd(const JoinedPart& part, const absl::Status& status) {
  const auto violation = FindViolation(status);
  LogEvent(spdlog::level::info, "part left",
           {{"stream", part.stream_id},
            {"part", std::uint64_t{part.seat.part}},
            {"status", absl::StatusCodeToString(status.code())},
            {"reason", violation ? violation->reason : std::string()}});
}

}  // namespace

ReconstructCall::ReconstructCall(CallChannel& channel, const MethodMeters* meters,
                                 absl::StatusOr<AdmittedCall> admission, const ServerLimits& limits,
                                 OpeningCalls& opening, StreamRegistry& registry,
                                 MemoryBudget& budget, ComputePool& pool,
                                 WatchDispatcher& dispatcher,
                                 const CurrentCheckpointKeys& checkpoint_keys)
    : ByteCall(channel, meters, std::move(admission)),
      registry_(registry),
      messages_(limits, registry, dispatcher, checkpoint_keys, {channel.peer(), caller().name()}),
      machine_(std::make_shared<StreamStateMachine>(static_cast<StreamTransport&>(*this), messages_,
                                                    pool, budget, limits.frames_in_flight,
                                                    caller().account())) {
  absl::Status status = this->admission();
  if (status.ok()) status = registry_.Enter(machine_, caller());
  if (status.ok()) MayGiveWay(opening, machine_);
  machine_->Start(std::move(status));
}

void ReconstructCall::ReadDone(bool ok) {
  if (ok) {
    machine_->ReadDone(messages_.Kind(read_slot_), messages_.request(read_slot_).Length());
  } else {
    // A read ends for a half-close and for a client that is gone; OnCancel may come later.
    if (channel().IsCancelled()) machine_->Cancelled();
    machine_->ReadEnded();
  }
}

void ReconstructCall::WriteDone(bool ok) {
  messages_.Written(written_, written_slot_);
  machine_->WriteDone(ok);
}

void ReconstructCall::OnCancel() { machine_->Cancelled(); }

void ReconstructCall::OnDone() { registry_.Leave(*machine_); }

void ReconstructCall::StartRead(std::size_t slot) {
  read_slot_ = slot;
  channel().StartRead(&messages_.request(slot));
}

void ReconstructCall::StartWrite(Outgoing what, std::size_t slot) {
  written_ = what;
  written_slot_ = slot;
  channel().StartWrite(&messages_.response(what, slot));
}

void ReconstructCall::Cut() { channel().Cancel(); }

void ReconstructCall::Finish(const absl::Status& status) {
  // Closed first: a client that sees the end may open the same name again at once.
  const auto stream = registry_.Close(*machine_);
  messages_.End(status);
  if (messages_.other_part()) {
    LogPartEnd(messages_.other_part()->joined(), status);
  } else {
    LogEnd(stream, channel().peer(), status);
  }
  if (stream) stream->description.broadcaster->End(WatchEnd::OfStream(status));
  End(status);
}

}  // namespace partiemc::server
