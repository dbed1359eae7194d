#include "library/stream_call.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "library/channel.h"
#include "wire/message_bytes.h"

namespace partiemc::client {
namespace {

// Beside the window's answers there may be a notice, and one message is being read into.
constexpr std::size_t kSpareMessages = 2;

// How long a call may take to end after its last message; then it is cut off.
constexpr std::chrono::seconds kEndTimeout(1);

// A server may announce any window; this one bounds the memory of this side.
constexpr std::size_t kMaxFramesInFlight = 64;

// What a message of gRPC holds at most, less room for what is round the frame.
constexpr std::uint64_t kMaxFrameBytes = std::numeric_limits<std::int32_t>::max() - 64;

std::string MethodName() {
  return absl::StrCat("/", v1::ReconstructionService::service_full_name(), "/Reconstruct");
}

std::string Seconds(std::chrono::milliseconds duration) {
  return absl::StrCat(static_cast<double>(duration.count()) / 1000, " s");
}

}  // namespace

Stream::Call::Call(std::shared_ptr<grpc::Channel> channel, std::string address,
                   std::chrono::milliseconds deadline)
    : address_(std::move(address)), deadline_(deadline), stub_(std::move(channel)) {
  spare_.push_back(std::make_unique<v1::ReconstructResponse>());
}

Stream::Call::~Call() {
  Cancel();
  Lock lock(mutex_);
  changed_.wait(lock, [this] { return done_ || !started_; });
}

absl::Status Stream::Call::Open(const StreamOptions& options) {
  v1::ReconstructRequest request;
  v1::OpenStream& open = *request.mutable_open();
  open.set_stream_name(options.name);
  wire::EncodeParameters(options.parameters, *open.mutable_parameters());
  wire::EncodeOutputs({.mesh = options.outputs.mesh,
                       .normals = options.outputs.normals,
                       .relative_float32 = options.outputs.relative_float32,
                       .echo_particles = options.outputs.echo_particles},
                      *open.mutable_outputs());
  open.mutable_labels()->insert(options.labels.begin(), options.labels.end());

  stub_.PrepareBidiStreamingCall(&context_, MethodName(), {}, this);
  Lock lock(mutex_);
  started_ = hold_ = true;
  progress_at_ = Clock::now();
  AddHold();
  StartCall();
  ReadNext(lock);
  Write(lock, wire::ToBytes(request));

  const auto due = progress_at_ + deadline_;
  changed_.wait_until(lock, due, [this] { return !ready_.empty() || done_; });
  if (ready_.empty()) {
    if (!done_) {
      return Fail(absl::DeadlineExceededError(
          absl::StrCat("the server at ", address_, " did not accept the stream within ",
                       Seconds(deadline_), ": it may be overloaded; try again later")));
    }
    const absl::Status end = FromGrpc(end_, address_);
    return end.ok() ? absl::UnavailableError(
                          absl::StrCat("the server at ", address_, " closed the stream at once"))
                    : end;
  }
  const std::unique_ptr<v1::ReconstructResponse> response = std::move(ready_.front());
  ready_.pop_front();
  if (!response->has_opened()) {
    return Fail(absl::DataLossError(absl::StrCat(
        "the server at ", address_, " did not begin with StreamOpened: it breaks the protocol")));
  }
  const v1::StreamOpened& opened = response->opened();
  auto parameters = wire::DecodeParameters(opened.parameters());
  if (!parameters.ok()) return Fail(parameters.status());
  info_ = {
      .stream_id = opened.stream_id(),
      .parameters = *parameters,
      .frames_in_flight = std::clamp<std::size_t>(opened.frames_in_flight(), 1, kMaxFramesInFlight),
      .limits = {.max_particles_per_frame = opened.limits().max_particles_per_frame(),
                 .max_frame_bytes = opened.limits().max_frame_bytes(),
                 .max_tiles_per_frame = opened.limits().max_tiles_per_frame()}};
  next_sequence_ = next_answer_ = std::max<std::uint64_t>(1, opened.next_sequence());
  while (spare_.size() < info_.frames_in_flight + kSpareMessages) {
    spare_.push_back(std::make_unique<v1::ReconstructResponse>());
  }
  ReadNext(lock);
  return absl::OkStatus();
}

absl::Status Stream::Call::CheckFits(const Frame& frame) const {
  const std::uint64_t limit = info_.limits.max_particles_per_frame;
  if (frame.components < 1 || limit == 0 || frame.ParticleCount() <= limit) {
    return absl::OkStatus();
  }
  return ViolationError(absl::StatusCode::kResourceExhausted,
                        {.reason = std::string(kReasonTooManyParticles),
                         .field = "positions",
                         .value = absl::StrCat(frame.ParticleCount(), " particles"),
                         .rule = absl::StrCat("the server takes at most ", limit)});
}

absl::StatusOr<std::uint64_t> Stream::Call::Send(const Frame& frame, double time) {
  const absl::Status fits = CheckFits(frame);
  if (!fits.ok()) return fits;
  Lock lock(mutex_);
  absl::Status ready = WaitToSend(lock, /*for_window=*/true);
  if (!ready.ok()) return ready;
  const std::uint64_t sequence = next_sequence_;
  lock.unlock();

  Frame timed = frame;
  timed.time = time;
  const wire::FrameRequest request(timed, sequence);
  const std::uint64_t bytes = request.frame_bytes();
  const std::uint64_t announced = info_.limits.max_frame_bytes;
  const std::uint64_t limit = announced == 0 ? kMaxFrameBytes : std::min(announced, kMaxFrameBytes);
  if (bytes > limit) {
    return ViolationError(absl::StatusCode::kResourceExhausted,
                          {.reason = "MESSAGE_TOO_LARGE",
                           .field = "frame",
                           .value = absl::StrCat(bytes, " bytes"),
                           .rule = absl::StrCat("the server takes at most ", limit)});
  }
  grpc::ByteBuffer request_bytes = request.ToBytes();
  lock.lock();
  ready = WaitToSend(lock, /*for_window=*/false);
  if (!ready.ok()) return ready;
  if (next_sequence_ == next_answer_) progress_at_ = Clock::now();
  ++next_sequence_;
  Write(lock, std::move(request_bytes));
  return sequence;
}

absl::Status Stream::Call::WaitToSend(Lock& lock, bool for_window) {
  const auto may_send = [this, for_window] {
    return done_ || reads_over_ || half_closed_ || !failure_.ok() ||
           (for_window ? next_sequence_ - next_answer_ < info_.frames_in_flight : !writing_);
  };
  const bool in_time = changed_.wait_for(lock, deadline_, may_send);
  if (!failure_.ok()) return failure_;
  if (half_closed_) return absl::FailedPreconditionError("Send after FinishSending");
  if (done_ || reads_over_) return EndOfAnswers(lock).status();
  if (in_time) return absl::OkStatus();
  return Fail(absl::DeadlineExceededError(
      ready_.empty() ? absl::StrCat("the server at ", address_, " has taken no frame for ",
                                    Seconds(deadline_), ": it may be overloaded; try again later")
                     : absl::StrCat("no answer was received for ", Seconds(deadline_), " while ",
                                    ready_.size(), " waited: call Receive before or beside Send")));
}

absl::Status Stream::Call::FinishSending() {
  Lock lock(mutex_);
  if (half_closed_) return absl::OkStatus();
  const absl::Status ready = WaitToSend(lock, /*for_window=*/false);
  if (!ready.ok()) return ready;
  half_closed_ = true;
  if (next_sequence_ == next_answer_) progress_at_ = Clock::now();
  ++outside_operations_;
  lock.unlock();
  StartWritesDone();
  lock.lock();
  EndOutsideOperation(lock);
  return absl::OkStatus();
}

absl::StatusOr<Received> Stream::Call::Receive(Event& event,
                                               std::optional<std::chrono::milliseconds> wait) {
  Lock lock(mutex_);
  const auto until = wait ? std::optional(Clock::now() + *wait) : std::nullopt;
  while (ready_.empty() && failure_.ok() && !done_) {
    const auto due = AnswerDue();
    const auto now = Clock::now();
    if (due && now >= *due) {
      if (reads_over_) return EndOfAnswers(lock);
      return Fail(absl::DeadlineExceededError(
          absl::StrCat("the server at ", address_, " did not answer frame ", next_answer_,
                       " within ", Seconds(deadline_), ": it may be overloaded; try again later")));
    }
    if (until && now >= *until) return Received::kNothingYet;
    if (due || until) {
      changed_.wait_until(lock, due && until ? std::min(*due, *until) : due ? *due : *until);
    } else {
      changed_.wait(lock);
    }
  }
  if (!failure_.ok()) return failure_;
  if (ready_.empty()) return EndOfAnswers(lock);

  std::unique_ptr<v1::ReconstructResponse> response = std::move(ready_.front());
  ready_.pop_front();
  lock.unlock();
  const absl::Status decoded = Decode(*response, event);
  lock.lock();
  if (!decoded.ok()) return Fail(decoded);
  if (event.kind != Event::Kind::kNotice) ++next_answer_;
  spare_.push_back(std::move(response));
  changed_.notify_all();
  if (reading_ == nullptr) {
    progress_at_ = Clock::now();  // Nothing was read meanwhile: that was not the server's fault.
    ReadNext(lock);
  }
  return Received::kEvent;
}

std::optional<Stream::Call::Clock::time_point> Stream::Call::AnswerDue() const {
  if (reads_over_) return progress_at_ + kEndTimeout;
  if (next_sequence_ != next_answer_ || half_closed_) return progress_at_ + deadline_;
  return std::nullopt;
}

absl::StatusOr<Received> Stream::Call::EndOfAnswers(Lock& lock) {
  changed_.wait_for(lock, kEndTimeout, [this] { return done_; });
  if (!failure_.ok()) return failure_;
  if (!done_) {
    return Fail(absl::DataLossError(absl::StrCat("an answer of the server at ", address_,
                                                 " cannot be read: it breaks the protocol")));
  }
  const absl::Status end = FromGrpc(end_, address_);
  if (!end.ok()) return end;
  if (next_answer_ != next_sequence_) {
    return absl::UnavailableError(
        absl::StrCat("the server at ", address_, " ended the stream and left ",
                     next_sequence_ - next_answer_, " frames unanswered: start again"));
  }
  if (half_closed_) return Received::kEnd;
  return absl::UnavailableError(
      absl::StrCat("the server at ", address_, " ended the stream: start again"));
}

absl::Status Stream::Call::CheckOrder(std::uint64_t sequence) const {
  // next_answer_ is written by the receiver's thread alone, which this is.
  if (sequence == next_answer_) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("the server at ", address_, " answered frame ", sequence,
                                          " where frame ", next_answer_,
                                          " was due: it breaks the protocol"));
}

absl::Status Stream::Call::Decode(v1::ReconstructResponse& response, Event& event) {
  if (response.has_frame()) {
    absl::Status status = CheckOrder(response.frame().sequence());
    if (!status.ok()) return status;
    std::swap(decoded_.result, event.frame.result);  // The caller's buffers are used again.
    status = wire::DecodeResult(response.frame(), decoded_);
    std::swap(decoded_.result, event.frame.result);
    if (!status.ok()) {
      return absl::Status(status.code(),
                          absl::StrCat("the server at ", address_, " answered frame ", next_answer_,
                                       " with ", status.message()));
    }
    event.kind = Event::Kind::kResult;
    event.sequence = decoded_.sequence;
    event.time = decoded_.time;
    event.frame.times = {.stages_ms = decoded_.times.stages_ms,
                         .total_ms = decoded_.times.total_ms};
    event.frame.rings_digest = decoded_.rings_digest;
    event.frame.mesh_digest = decoded_.mesh_digest;
    return absl::OkStatus();
  }
  if (response.has_error()) {
    const v1::FrameError& error = response.error();
    event.kind = Event::Kind::kRefusal;
    event.sequence = error.sequence();
    event.violation = {.reason = error.reason(),
                       .field = error.field(),
                       .value = error.value(),
                       .rule = error.rule()};
    event.message = error.message();
    return CheckOrder(error.sequence());
  }
  if (response.has_notice()) {
    event.kind = Event::Kind::kNotice;
    event.sequence = 0;
    event.message = response.notice().message();
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("the server at ", address_,
                                          " sent an answer that this client does not know: use a "
                                          "client of the server's version"));
}

std::size_t Stream::Call::InFlight() const {
  const std::scoped_lock lock(mutex_);
  return next_sequence_ - next_answer_;
}

void Stream::Call::Cancel() {
  Lock lock(mutex_);
  if (!started_ || done_) return;
  Fail(absl::CancelledError("the stream was cancelled")).IgnoreError();
  if (reading_ == nullptr) {
    reads_over_ = true;  // No read will tell that the call is over.
    ReleaseHoldWhenIdle(lock);
  }
}

absl::Status Stream::Call::Fail(absl::Status failure) {
  if (failure_.ok()) failure_ = std::move(failure);
  context_.TryCancel();
  changed_.notify_all();
  return failure_;
}

void Stream::Call::Write(Lock& lock, grpc::ByteBuffer request) {
  writing_ = true;
  ++outside_operations_;
  request_.Swap(&request);
  lock.unlock();
  StartWrite(&request_);
  lock.lock();
  EndOutsideOperation(lock);
}

void Stream::Call::ReadNext(Lock& lock) {
  if (reads_over_ || spare_.empty()) return;
  reading_ = std::move(spare_.back());
  spare_.pop_back();
  ++outside_operations_;
  v1::ReconstructResponse* const into = reading_.get();
  lock.unlock();
  StartRead(into);
  lock.lock();
  EndOutsideOperation(lock);
}

void Stream::Call::EndOutsideOperation(Lock& lock) {
  --outside_operations_;
  ReleaseHoldWhenIdle(lock);
}

void Stream::Call::ReleaseHoldWhenIdle(Lock& lock) {
  if (!reads_over_ || outside_operations_ > 0 || !hold_) return;
  hold_ = false;
  lock.unlock();
  RemoveHold();
  lock.lock();
}

void Stream::Call::OnWriteDone(bool ok) {
  // A failed write is told by the end of the reads and by OnDone, with its reason.
  const std::scoped_lock lock(mutex_);
  writing_ = !ok;
  request_.Clear();
  changed_.notify_all();
}

void Stream::Call::OnReadDone(bool ok) {
  Lock lock(mutex_);
  progress_at_ = Clock::now();
  if (ok) {
    ready_.push_back(std::move(reading_));
    ReadNext(lock);
  } else {
    spare_.push_back(std::move(reading_));
    reads_over_ = true;
    ReleaseHoldWhenIdle(lock);
  }
  changed_.notify_all();
}

void Stream::Call::OnDone(const grpc::Status& status) {
  const std::scoped_lock lock(mutex_);
  end_ = status;
  done_ = true;
  changed_.notify_all();
}

}  // namespace partiemc::client
