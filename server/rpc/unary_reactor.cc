#include "server/rpc/unary_reactor.h"

#include <utility>

#include "server/telemetry/logging.h"

namespace partiemc::server {

UnaryReactor::UnaryReactor(grpc::CallbackServerContext& context,
                           absl::StatusOr<AdmittedCall> admission, UnaryKind kind,
                           OpeningCalls& opening, UnaryRegistry& calls, MemoryBudget& budget,
                           ComputePool* pool, Method method)
    : ByteCall(context, std::move(admission)),
      calls_(calls),
      method_(std::move(method)),
      machine_(std::make_shared<UnaryStateMachine>(static_cast<UnaryTransport&>(*this), budget,
                                                   pool, caller().account(), kind)) {
  absl::Status status = this->admission();
  if (status.ok()) status = calls_.Enter(machine_, kind);
  if (status.ok()) MayGiveWay(opening, machine_);
  machine_->Start(std::move(status));
}

void UnaryReactor::OnReadDone(bool ok) {
  RequestCame();
  if (ok) {
    if (auto status = calls_.TakePlace(*machine_, *caller().account()); !status.ok()) {
      return machine_->GiveWay(status);
    }
    machine_->ReadDone(request_.Length());
  } else {
    // A read ends for a half-close and for a client that is gone; OnCancel may come later.
    if (IsCancelled()) machine_->Cancelled();
    machine_->ReadEnded();
  }
}

void UnaryReactor::OnWriteDone(bool ok) {
  answer_.Clear();
  machine_->WriteDone(ok);
}

void UnaryReactor::OnCancel() { machine_->Cancelled(); }

void UnaryReactor::Left() { calls_.Leave(*machine_); }

void UnaryReactor::StartRead() { ServerBidiReactor::StartRead(&request_); }

absl::StatusOr<std::uint64_t> UnaryReactor::Answer(Worker* worker) {
  auto answer = method_(request_, worker, machine_->cancelled());
  request_.Clear();
  if (!answer.ok()) return answer.status();
  answer_.Swap(&*answer);
  return answer_.Length();
}

void UnaryReactor::StartWrite() { ServerBidiReactor::StartWrite(&answer_); }

void UnaryReactor::Cut() { CancelCall(); }

void UnaryReactor::Finish(const absl::Status& status) {
  answer_.Clear();                  // One that was not sent.
  calls_.GiveBackPlace(*machine_);  // Who hears of the end may come again at once.
  if (!status.ok() && !absl::IsCancelled(status)) LogRefusal("call refused", peer(), status);
  End(status);
}

}  // namespace partiemc::server
