#include "server/calls/unary_call.h"

#include <utility>

#include "server/telemetry/logging.h"

namespace partiemc::server {

UnaryCall::UnaryCall(ArrivedCall call, const ServerContext& context, UnaryKind kind, Method method)
    : ByteCall(std::move(call)),
      calls_(context.unary_calls),
      method_(std::move(method)),
      machine_(std::make_shared<UnaryStateMachine>(
          static_cast<UnaryTransport&>(*this), context.budget,
          kind == UnaryKind::kFrame ? &context.pool : nullptr, caller().account(), kind)) {
  absl::Status status = this->admission();
  if (status.ok()) status = calls_.Enter(machine_, kind);
  if (status.ok()) MayGiveWay(context.opening, machine_);
  machine_->Start(std::move(status));
}

void UnaryCall::ReadDone(bool ok) {
  if (ok) {
    if (auto status = calls_.TakePlace(*machine_, *caller().account()); !status.ok()) {
      return machine_->GiveWay(status);
    }
    machine_->ReadDone(request_.Length());
  } else {
    // A read ends at a half-close and at a disconnect; OnCancel may come later.
    if (channel().IsCancelled()) machine_->Cancelled();
    machine_->ReadEnded();
  }
}

void UnaryCall::WriteDone(bool ok) {
  answer_.Clear();
  machine_->WriteDone(ok);
}

void UnaryCall::OnCancel() { machine_->Cancelled(); }

void UnaryCall::OnDone() { calls_.Leave(*machine_); }

void UnaryCall::StartRead() { channel().StartRead(&request_); }

absl::StatusOr<std::uint64_t> UnaryCall::Answer(Worker* worker) {
  auto answer = method_(request_, worker, machine_->cancelled());
  request_.Clear();
  if (!answer.ok()) return answer.status();
  answer_.Swap(&*answer);
  return answer_.Length();
}

void UnaryCall::StartWrite() { channel().StartWrite(&answer_); }

void UnaryCall::Cut() { channel().Cancel(); }

void UnaryCall::Finish(const absl::Status& status) {
  answer_.Clear();
  calls_.GiveBackPlace(*machine_);  // First: a client that sees the end may call again at once.
  if (!status.ok() && !absl::IsCancelled(status))
    LogRefusal("call refused", channel().peer(), status);
  End(status);
}

}  // namespace partiemc::server
