#include "server/reconstruct_reactor.h"

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "server/grpc_status.h"
#include "server/logging.h"

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
            {"watch_waits", stream->description.hub->producer_waits()},
            {"seconds", open.count()},
            {"status", absl::StatusCodeToString(status.code())},
            {"reason", violation ? violation->reason : std::string()}});
}

}  // namespace

ReconstructReactor::ReconstructReactor(grpc::CallbackServerContext& context,
                                       const ServerLimits& limits, StreamRegistry& registry,
                                       MemoryBudget& budget, ComputePool& pool, WatchPump& pump,
                                       std::string client)
    : context_(context),
      client_(std::move(client)),
      registry_(registry),
      messages_(limits, registry, pump),
      flow_(std::make_shared<StreamFlow>(static_cast<StreamDoor&>(*this), pool, budget,
                                         limits.frames_in_flight)) {
  if (auto status = registry_.Enter(flow_); !status.ok()) {
    Finish(status);
  } else {
    flow_->Start();
  }
}

void ReconstructReactor::OnReadDone(bool ok) {
  if (ok) {
    flow_->ReadDone(messages_.Kind(read_slot_), messages_.request(read_slot_).Length());
  } else {
    // A read ends for a half-close and for a client that is gone; OnCancel may come later.
    if (context_.IsCancelled()) flow_->Cancelled();
    flow_->ReadEnded();
  }
}

void ReconstructReactor::OnWriteDone(bool ok) {
  messages_.Written(written_, written_slot_);
  flow_->WriteDone(ok);
}

void ReconstructReactor::OnCancel() { flow_->Cancelled(); }

void ReconstructReactor::OnDone() {
  registry_.Leave(*flow_);
  delete this;
}

void ReconstructReactor::StartRead(std::size_t slot) {
  read_slot_ = slot;
  ServerBidiReactor::StartRead(&messages_.request(slot));
}

void ReconstructReactor::StartWrite(Outgoing what, std::size_t slot) {
  written_ = what;
  written_slot_ = slot;
  ServerBidiReactor::StartWrite(&messages_.response(what, slot));
}

absl::Status ReconstructReactor::Open(std::size_t slot) {
  const auto stream = messages_.Open(slot, *flow_);
  if (!stream.ok()) return stream.status();
  const StreamDescription& description = stream->description;
  LogEvent(spdlog::level::info, "stream opened",
           {{"id", stream->id},
            {"name", description.name},
            {"peer", context_.peer()},
            {"client", client_},
            {"placement", std::string(Name(description.parameters.placement))},
            {"fill", std::string(Name(description.parameters.fill))}});
  return absl::OkStatus();
}

Answered ReconstructReactor::Answer(std::size_t slot, Worker& worker) {
  return messages_.Answer(slot, worker);
}

void ReconstructReactor::Cut() { context_.TryCancel(); }

void ReconstructReactor::Finish(const absl::Status& status) {
  // Closed first: a client that sees the end may open the same name again at once.
  const auto stream = registry_.Close(*flow_);
  LogEnd(stream, context_.peer(), status);
  if (stream) stream->description.hub->End(WatchEnd::OfStream(status));
  ServerBidiReactor::Finish(ToGrpcStatus(status, context_));
}

}  // namespace partiemc::server
