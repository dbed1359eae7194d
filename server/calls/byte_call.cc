#include "server/calls/byte_call.h"

#include "server/telemetry/logging.h"

namespace partiemc::server {

ByteCall::ByteCall(ArrivedCall call, const ServerContext& context)
    : channel_(call.channel),
      meters_(call.meters),
      context_(context),
      admission_(call.admission.status()),
      client_(std::move(call.client)) {
  if (call.admission.ok()) call_ = *std::move(call.admission);
  if (meters_ != nullptr) meters_->Started();
}

void ByteCall::OnReadDone(bool ok) {
  opening_ = {};
  if (ok) {
    if (meters_ != nullptr) meters_->Received();
    return OnRequest();
  }
  // A read fails if the client half-closes or disconnects. After a disconnect, the channel may call
  // OnCancel only later, but OnRequestsEnded would take the disconnect for a half-close.
  if (channel_.IsCancelled()) OnCancel();
  OnRequestsEnded();
}

void ByteCall::OnWriteDone(bool ok) {
  if (ok && meters_ != nullptr) meters_->Sent();
  OnResponseWritten(ok);
}

void ByteCall::End(const absl::Status& status) {
  if (ended_.exchange(true)) {
    LogEvent(spdlog::level::err, "a call was ended twice", {{"peer", channel_.peer()}});
    return;
  }
  call_.place = {};  // First: a client that sees the end may call again at once.
  if (meters_ != nullptr) {
    meters_->Handled(status.code(), std::chrono::steady_clock::now() - came_);
  }
  channel_.Finish(status);
}

}  // namespace partiemc::server
