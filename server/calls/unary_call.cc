#include "server/calls/unary_call.h"

#include <utility>

#include "server/stream/unary_registry.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {

UnaryCall::UnaryCall(ArrivedCall call, const ServerContext& context, UnaryKind kind, Method method)
    : ByteCall(std::move(call), context),
      method_(std::move(method)),
      machine_(std::make_shared<UnaryStateMachine>(
          static_cast<UnaryTransport&>(*this), context.budget,
          kind == UnaryKind::kFrame ? &context.pool : nullptr, caller().account(), kind)) {
  absl::Status status = admission();
  if (status.ok()) status = context.unary_calls.Enter(machine_, kind);
  if (status.ok()) AllowEviction(machine_);
  machine_->Start(std::move(status));
}

void UnaryCall::OnRequest() {
  auto status = context().unary_calls.TakePlace(*machine_, *caller().account());
  if (!status.ok()) return machine_->GiveWay(status);
  machine_->ReadDone(request_.Length());
}

void UnaryCall::OnResponseWritten(bool ok) {
  answer_.Clear();
  machine_->WriteDone(ok);
}

void UnaryCall::OnDone() { context().unary_calls.Leave(*machine_); }

absl::StatusOr<std::uint64_t> UnaryCall::Answer(Worker* worker) {
  auto answer = method_(request_, worker, machine_->cancelled());
  request_.Clear();
  if (!answer.ok()) return answer.status();
  answer_.Swap(&*answer);
  return answer_.Length();
}

void UnaryCall::Finish(const absl::Status& status) {
  answer_.Clear();  // It may not have been written.
  // Frees the slot before End, because a client that receives the end may call again at once.
  context().unary_calls.GiveBackPlace(*machine_);
  if (!status.ok() && !absl::IsCancelled(status))
    LogRefusal("call refused", channel().peer(), status, client());
  End(status);
}

}  // namespace partiemc::server
