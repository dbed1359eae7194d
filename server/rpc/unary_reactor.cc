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
      flow_(std::make_shared<UnaryFlow>(static_cast<UnaryDoor&>(*this), budget, pool,
                                        caller().account(), kind)) {
  absl::Status status = this->admission();
  if (status.ok()) status = calls_.Enter(flow_, kind);
  if (status.ok()) MayGiveWay(opening, flow_);
  flow_->Start(std::move(status));
}

void UnaryReactor::OnReadDone(bool ok) {
  RequestCame();
  if (ok) {
    if (auto status = calls_.TakePlace(*flow_, *caller().account()); !status.ok()) {
      return flow_->GiveWay(status);
    }
    flow_->ReadDone(request_.Length());
  } else {
    // A read ends for a half-close and for a client that is gone; OnCancel may come later.
    if (IsCancelled()) flow_->Cancelled();
    flow_->ReadEnded();
  }
}

void UnaryReactor::OnWriteDone(bool ok) {
  answer_.Clear();
  flow_->WriteDone(ok);
}

void UnaryReactor::OnCancel() { flow_->Cancelled(); }

void UnaryReactor::Left() { calls_.Leave(*flow_); }

void UnaryReactor::StartRead() { ServerBidiReactor::StartRead(&request_); }

absl::StatusOr<std::uint64_t> UnaryReactor::Answer(Worker* worker) {
  auto answer = method_(request_, worker, flow_->cancelled());
  request_.Clear();
  if (!answer.ok()) return answer.status();
  answer_.Swap(&*answer);
  return answer_.Length();
}

void UnaryReactor::StartWrite() { ServerBidiReactor::StartWrite(&answer_); }

void UnaryReactor::Cut() { CancelCall(); }

void UnaryReactor::Finish(const absl::Status& status) {
  answer_.Clear();               // One that was not sent.
  calls_.GiveBackPlace(*flow_);  // Who hears of the end may come again at once.
  if (!status.ok() && !absl::IsCancelled(status)) LogRefusal("call refused", peer(), status);
  End(status);
}

}  // namespace partiemc::server
