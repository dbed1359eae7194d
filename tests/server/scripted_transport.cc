#include "server/scripted_transport.h"

#include <stdexcept>
#include <utility>

#include "partiemc/status.h"

namespace partiemc::server {

MemoryAnswer AnswerInMemory(const MemoryRequest& request, Session& session, Worker& worker) {
  MemoryAnswer answer{Outgoing::kAnswer, request.sequence, {}, {}};
  Frame frame;
  frame.positions = std::span<const double>(request.positions);
  const auto status =
      session.Answer(request.sequence, frame, worker, [&](const Result& result, auto&) {
        answer.digests = {DigestRings(result.rings), DigestMesh(result.mesh)};
        return absl::OkStatus();
      });
  if (!status.ok()) answer.reason = FindViolation(status)->reason;
  return answer;
}

ScriptedTransport::ScriptedTransport(SteppedPool& pool, MemoryBudget& budget, std::size_t window,
                                     const ReconstructionParameters& parameters,
                                     const FrameLimits& limits)
    : parameters_(parameters),
      limits_(limits),
      requests_(window),
      answers_(window),
      machine_(std::make_shared<StreamStateMachine>(static_cast<StreamTransport&>(*this),
                                                    static_cast<StreamHandler&>(*this), pool.pool(),
                                                    budget, window)) {
  machine_->Start();
}

void ScriptedTransport::BringRequest(MemoryRequest request) {
  const RequestKind kind = request.kind;
  const std::uint64_t bytes = request.positions.size() * sizeof(double);
  requests_.at(read_slot_.value()) = std::move(request);
  read_slot_.reset();
  machine_->ReadDone(kind, bytes);
}

void ScriptedTransport::EndReads() {
  read_slot_.reset();
  machine_->ReadEnded();
}

void ScriptedTransport::EndWrite(bool ok) {
  writing_.reset();
  machine_->WriteDone(ok);
}

void ScriptedTransport::StartRead(std::size_t slot) {
  if (read_slot_ || finished_) throw std::logic_error("two reads at once, or one after the end");
  read_slot_ = slot;
}

void ScriptedTransport::StartWrite(Outgoing what, std::size_t slot) {
  if (writing_ || finished_) throw std::logic_error("two writes at once, or one after the end");
  writing_ = what == Outgoing::kAnswer ? answers_.at(slot) : MemoryAnswer{what, 0, {}, {}};
}

absl::Status ScriptedTransport::Open(std::size_t, const StreamStateMachine&) {
  auto session = Session::Open(parameters_, limits_);
  if (session.ok()) session_ = *std::move(session);
  Meanwhile();
  return session.status();
}

Answered ScriptedTransport::Answer(std::size_t slot, Worker& worker, const std::atomic<bool>&) {
  answers_.at(slot) = AnswerInMemory(requests_.at(slot), *session_, worker);
  Meanwhile();
  return {.is_result = answers_[slot].reason.empty(),
          .last_sequence = session_->next_sequence() - 1,
          .bytes = 0,
          .afterwards = afterwards};
}

void ScriptedTransport::Cut() {
  if (finished_) throw std::logic_error("cut after the end");
  cut_ = true;
}

void ScriptedTransport::Finish(const absl::Status& status) {
  if (finished_ || writing_) throw std::logic_error("finished twice, or while writing");
  finished_ = status;
}

void ScriptedTransport::Meanwhile() {
  if (const auto happens = std::exchange(meanwhile, nullptr)) happens();
}

}  // namespace partiemc::server
