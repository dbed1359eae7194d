#include "client/library/stream_call.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/library/answer.h"
#include "client/library/channel.h"
#include "wire/message_bytes.h"

namespace partiemc::client {
namespace {

// Messages in addition to one for each frame of the window: one for a notice, and one for the
// current read.
constexpr std::size_t kSpareMessages = 2;

std::string MethodName() {
  return absl::StrCat("/", v1::ReconstructionService::service_full_name(), "/Reconstruct");
}

}  // namespace

StreamCall::StreamCall(Monitor& monitor, std::shared_ptr<grpc::Channel> channel,
                       std::string address)
    : monitor_(monitor), address_(std::move(address)), stub_(std::move(channel)) {
  spare_.push_back(std::make_unique<v1::ReconstructResponse>());
}

StreamCall::~StreamCall() {
  const MutexLock lock(monitor_.mutex);
  Cancel();
  while (started_ && !done_) monitor_.changed.Wait(monitor_.mutex);
}

void StreamCall::Start(const v1::OpenStream& open) {
  v1::ReconstructRequest request;
  *request.mutable_open() = open;
  stub_.PrepareBidiStreamingCall(&context_, MethodName(), {}, this);
  const MutexLock lock(monitor_.mutex);
  started_ = hold_ = writing_ = true;
  request_ = wire::ToBytes(request);
  AddHold();
  StartCall();
  ReadNext();
  RunOutside([this] { StartWrite(&request_); });
}

void StreamCall::SetWindow(std::size_t frames) {
  window_ = frames;
  while (spare_.size() < frames + kSpareMessages) {
    spare_.push_back(std::make_unique<v1::ReconstructResponse>());
  }
  if (reading_ == nullptr) ReadNext();
  WriteNext();
}

void StreamCall::Queue(grpc::ByteBuffer frame) {
  queue_.push_back(std::move(frame));
  WriteNext();
}

void StreamCall::HalfClose() {
  half_close_wanted_ = true;
  WriteNext();
}

void StreamCall::Cancel() {
  if (!started_ || done_) return;
  cancelled_ = true;
  context_.TryCancel();
  EndReadsIfCancelled();
}

// Ends the reads of a cancelled call if no read is pending, because then no callback would report
// the end of the call.
void StreamCall::EndReadsIfCancelled() {
  if (!cancelled_ || reading_ != nullptr) return;
  reads_over_ = true;
  ReleaseHoldWhenIdle();
}

StreamCall::Response StreamCall::Take() {
  if (ready_.empty()) return nullptr;
  Response response = std::move(ready_.front());
  ready_.pop_front();
  return response;
}

void StreamCall::Recycle(Response response) {
  spare_.push_back(std::move(response));
  if (reading_ != nullptr || window_ == 0) return;
  // Restarts the deadline of the next answer: no read was pending, so the server could not answer.
  // A notice does not restart the deadline, because a server can send any number of notices.
  if (IsAnswer(*spare_.back())) progress_at_ = monitor_.Now();
  ReadNext();
}

bool StreamCall::HasAnswer() const {
  return std::ranges::any_of(ready_, [](const Response& response) { return IsAnswer(*response); });
}

std::string StreamCall::reason() const { return ReasonOf(context_); }

void StreamCall::WriteNext() {
  if (writing_ || reads_over_ || half_closed_) return;
  if (!queue_.empty()) {
    if (written_ - answered_ >= window_) return;
    ++written_;
    writing_ = true;
    request_.Swap(&queue_.front());
    queue_.pop_front();
    RunOutside([this] { StartWrite(&request_); });
  } else if (half_close_wanted_) {
    half_closed_ = true;
    RunOutside([this] { StartWritesDone(); });
  }
}

void StreamCall::ReadNext() {
  if (reads_over_ || spare_.empty()) return;
  reading_ = std::move(spare_.back());
  spare_.pop_back();
  RunOutside([this, into = reading_.get()] { StartRead(into); });
}

// Starts a gRPC operation without the lock, because gRPC may call back immediately. The hold stays
// until the operation has started.
template <typename Operation>
void StreamCall::RunOutside(Operation operation) {
  ++outside_operations_;
  {
    const MutexUnlock unlock(monitor_.mutex);
    operation();
  }
  --outside_operations_;
  ReleaseHoldWhenIdle();
}

void StreamCall::ReleaseHoldWhenIdle() {
  if (!reads_over_ || outside_operations_ > 0 || !hold_) return;
  hold_ = false;
  const MutexUnlock unlock(monitor_.mutex);
  RemoveHold();
}

void StreamCall::OnWriteDone(bool ok) {
  // A failed write is not handled here: the end of the reads and OnDone report it with its reason.
  const MutexLock lock(monitor_.mutex);
  writing_ = !ok;
  request_.Clear();
  WriteNext();
  monitor_.changed.NotifyAll();
}

void StreamCall::OnReadDone(bool ok) {
  const MutexLock lock(monitor_.mutex);
  if (!ok || IsAnswer(*reading_) || reading_->has_opened()) progress_at_ = monitor_.Now();
  if (ok) {
    if (IsAnswer(*reading_)) ++answered_;
    ready_.push_back(std::move(reading_));
    ReadNext();
    WriteNext();
    EndReadsIfCancelled();
  } else {
    spare_.push_back(std::move(reading_));
    reads_over_ = true;
    ReleaseHoldWhenIdle();
  }
  monitor_.changed.NotifyAll();
}

void StreamCall::OnDone(const grpc::Status& status) {
  const MutexLock lock(monitor_.mutex);
  end_ = status;
  done_ = true;
  monitor_.changed.NotifyAll();
}

}  // namespace partiemc::client
