#include "server/web/web_channel.h"

#include "absl/strings/str_cat.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

// Requests for information, and those of a watcher, are far smaller; what is slightly too large
// for them is refused by the call, which says why.
constexpr std::uint64_t kMostSmallMessage = 64 << 10;

std::uint64_t LimitOf(Methods::Method method, const ServerLimits& limits) {
  const bool carries_frames =
      method == Methods::Method::kReconstruct || method == Methods::Method::kReconstructFrame;
  return carries_frames ? limits.MaxMessageBytes() : kMostSmallMessage;
}

}  // namespace

void WebChannel::Begin(Methods::Method method, CallOrigin origin) {
  self_ = shared_from_this();
  message_limit_ = LimitOf(method, connection_->context.limits);
  connection_->WhenClosed([weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->Gone();
  });
  call_ = connection_->context.methods.Begin(method, *this, origin);
}

void WebChannel::StartRead(grpc::ByteBuffer* message) {
  Post([this, message] {
    wanted_ = message;
    if (cancelled_ || finished_) return ReadEnded();
    if (admitted_) return Read();
    // A call that is refused may begin a read too, and ends at once: that has been posted by now.
    Post([this] {
      if (wanted_ == nullptr) return;
      admitted_ = true;
      connection_->slot.SetState(ConnectionSlots::State::kPending);
      Read();
    });
  });
}

void WebChannel::StartWrite(const grpc::ByteBuffer* message) {
  Post([this, message] {
    writing_ = true;
    if (gone_) return Written(false);
    Write(*message);
  });
}

void WebChannel::Cancel() {
  cancelled_ = true;
  Post([this] {
    // What is being written has its place in the connection: nothing can be sent after half of it.
    if (writing_) return connection_->Close();
    TellCancelled();
  });
}

void WebChannel::Finish(const absl::Status& status) {
  Post([this, status] {
    finished_ = true;
    if (admitted_) connection_->slot.SetState(ConnectionSlots::State::kPending);
    if (wanted_ != nullptr) ReadEnded();
    const absl::Status& told = told_instead_ ? *told_instead_ : status;
    if (!admitted_ && !told.ok()) connection_->context.refusals.Count(WebRefusal::kCall);
    Tell(told);
  });
}

void WebChannel::Deliver(grpc::ByteBuffer message) {
  if (!finished_) connection_->slot.SetState(ConnectionSlots::State::kServed);
  std::exchange(wanted_, nullptr)->Swap(&message);
  call_->OnReadDone(true);
}

void WebChannel::ReadEnded() {
  if (std::exchange(wanted_, nullptr) != nullptr) call_->OnReadDone(false);
}

void WebChannel::Written(bool ok) {
  writing_ = false;
  call_->OnWriteDone(ok);
}

void WebChannel::TellCancelled() {
  if (call_ == nullptr) return;
  cancelled_ = true;
  ReadEnded();
  if (!finished_ && !std::exchange(told_cancel_, true)) call_->OnCancel();
}

void WebChannel::Gone() {
  gone_ = true;
  TellCancelled();
}

void WebChannel::Break(WebRefusal refusal, absl::Status status) {
  if (finished_ || told_instead_) return;
  connection_->context.Refuse(refusal, connection_->peer, status);
  told_instead_ = std::move(status);
  connection_->CloseAfter(kWebCloseTime);
  TellCancelled();
}

void WebChannel::Over() {
  connection_->WhenClosed(nullptr);
  call_->OnDone();
  call_.reset();
  self_.reset();  // Whoever calls this holds it too.
}

absl::Status WebChannel::TooLarge(std::uint64_t bytes) const {
  return absl::ResourceExhaustedError(
      absl::StrCat("a message of at least ", bytes, " bytes; must be at most ", message_limit_));
}

}  // namespace partiemc::server
