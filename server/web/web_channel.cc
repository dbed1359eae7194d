#include "server/web/web_channel.h"

#include "absl/strings/str_cat.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

// Maximum message size for methods with small requests. It exceeds the limits of these methods, so
// that the call itself refuses a slightly oversized request, with a reason.
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
    if (const auto self = weak.lock()) self->OnDisconnect();
  });
  call_ = connection_->context.methods.Begin(method, *this, origin);
}

void WebChannel::StartRead(grpc::ByteBuffer* message) {
  Post([this, message] {
    wanted_ = message;
    if (cancelled_ || finished_) return ReadEnded();
    if (admitted_) return Read();
    // Posts the read, because a refused call may also start one. Such a call ends at once, so its
    // end was posted earlier and runs before this action (wanted_ is then null).
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
    // A half-written message leaves the connection unusable.
    if (writing_) return connection_->Close();
    CancelCall();
  });
}

void WebChannel::Finish(const absl::Status& status) {
  Post([this, status] {
    finished_ = true;
    if (admitted_) connection_->slot.SetState(ConnectionSlots::State::kPending);
    if (wanted_ != nullptr) ReadEnded();
    const absl::Status& told = break_status_ ? *break_status_ : status;
    if (!admitted_ && !told.ok()) connection_->context.refusals.Count(WebRefusal::kCall);
    SendEnd(told);
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

void WebChannel::CancelCall() {
  if (call_ == nullptr) return;
  cancelled_ = true;
  ReadEnded();
  if (!finished_ && !std::exchange(cancel_reported_, true)) call_->OnCancel();
}

void WebChannel::OnDisconnect() {
  gone_ = true;
  CancelCall();
}

void WebChannel::Break(WebRefusal refusal, absl::Status status) {
  if (finished_ || break_status_) return;
  connection_->context.Refuse(refusal, connection_->peer, status);
  break_status_ = std::move(status);
  connection_->CloseAfter(kWebCloseTime);
  CancelCall();
}

void WebChannel::OnEndSent() {
  connection_->WhenClosed(nullptr);
  call_->OnDone();
  call_.reset();
  self_.reset();  // The caller of this function holds another reference.
}

absl::Status WebChannel::TooLarge(std::uint64_t bytes) const {
  return absl::ResourceExhaustedError(
      absl::StrCat("a message of at least ", bytes, " bytes; must be at most ", message_limit_));
}

}  // namespace partiemc::server
