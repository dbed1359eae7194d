#include "server/calls/byte_call.h"

#include "server/telemetry/logging.h"

namespace partiemc::server {

ByteCall::ByteCall(ArrivedCall call)
    : channel_(call.channel), meters_(call.meters), admission_(call.admission.status()) {
  if (call.admission.ok()) call_ = *std::move(call.admission);
  if (meters_ != nullptr) meters_->Started();
}

void ByteCall::OnReadDone(bool ok) {
  RequestCame();
  if (ok && meters_ != nullptr) meters_->Received();
  ReadDone(ok);
}

void ByteCall::OnWriteDone(bool ok) {
  if (ok && meters_ != nullptr) meters_->Sent();
  WriteDone(ok);
}

void ByteCall::End(const absl::Status& status) {
  if (ended_.exchange(true)) {
    LogEvent(spdlog::level::err, "a call was ended twice", {{"peer", channel_.peer()}});
    return;
  }
  call_.place = {};  // Who hears of the end may come again at once.
  if (meters_ != nullptr) {
    meters_->Handled(status.code(), std::chrono::steady_clock::now() - came_);
  }
  channel_.Finish(status);
}

}  // namespace partiemc::server
