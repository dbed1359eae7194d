#include "client/library/resuming_stream.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/library/answer.h"
#include "client/library/channel.h"
#include "client/library/credentials.h"
#include "client/library/frame_request.h"
#include "client/library/gather.h"
#include "partiemc/status.h"
#include "wire/message_bytes.h"

namespace partiemc::client {
namespace {

// The error for a frame with a box of its own, which the server ignores.
absl::Status BoxesNotSupported() {
  return ViolationError(absl::StatusCode::kUnimplemented,
                        {.reason = "UNSUPPORTED",
                         .field = "frame.box",
                         .value = "set",
                         .rule = "requires a server with the capability frame-boxes: use a newer "
                                 "one"});
}

constexpr auto kNever = Clock::TimePoint::max();

// Returns the purpose that classifies the end of a call that was open. It is never kResume: its
// refusals, such as a name in use, can only end a call that has not opened.
CallPurpose LossPurpose(const StreamOptions& options) {
  return options.parts.part > 0 ? CallPurpose::kJoin : CallPurpose::kOpen;
}

absl::Status CheckParts(const StreamOptions& options) {
  const FrameParts& parts = options.parts;
  if (parts.part >= std::max(parts.parts, 1u)) {
    return InvalidOption("part", absl::StrCat(parts.part), "must be below parts");
  }
  if (parts.parts == 0) return absl::OkStatus();
  if (options.name.empty()) {
    return InvalidOption("name", "\"\"", "must be given if frames come in parts");
  }
  const std::chrono::milliseconds most =
      std::min<std::chrono::milliseconds>(options.deadline, std::chrono::minutes(10));
  if (parts.timeout < std::chrono::milliseconds(1) || parts.timeout > most) {
    return InvalidOption("timeout", absl::StrCat(parts.timeout.count(), " ms"),
                         absl::StrCat("must be 1 ms to ", most.count(), " ms"));
  }
  return absl::OkStatus();
}

// Whether `limit` is at least as large as `former`. A limit of 0 means no limit.
bool AllowsAsMuch(std::uint64_t limit, std::uint64_t former) {
  return limit == 0 || (former != 0 && limit >= former);
}

}  // namespace

absl::StatusOr<std::unique_ptr<Stream>> Stream::Open(std::string_view address,
                                                     const StreamOptions& options) {
  if (auto valid = Validate(options.parameters); !valid.ok()) return valid;
  if (auto valid = CheckParts(options); !valid.ok()) return valid;
  return ResumingStream::Open(address, options);
}

ResumingStream::ResumingStream(std::vector<std::string> addresses, const StreamOptions& options,
                               const TimeAndChance& surroundings)
    : options_(options),
      monitor_(surroundings),
      connector_(monitor_, std::move(addresses), options) {}

absl::StatusOr<std::unique_ptr<ResumingStream>> ResumingStream::Open(
    std::string_view address, const StreamOptions& options, const TimeAndChance& surroundings) {
  std::vector<std::string> addresses{std::string(address)};
  addresses.insert(addresses.end(), options.fallback_addresses.begin(),
                   options.fallback_addresses.end());
  for (const std::string& one : addresses) {
    const auto channel = MakeChannel(one, options.credentials);
    if (!channel.ok()) return channel.status();
  }
  std::unique_ptr<ResumingStream> stream(
      new ResumingStream(std::move(addresses), options, surroundings));
  absl::Status status;
  {
    const MutexLock lock(stream->monitor_.mutex);
    status = stream->OpenFirst();
  }
  if (!status.ok()) return status;
  return stream;
}

absl::Status ResumingStream::OpenFirst() {
  AssertShared();
  auto opened = connector_.OpenNew();
  if (!opened.ok()) return opened.status();
  auto info = ReadOpened(opened->message, options_.parameters);
  if (!info.ok()) {
    connector_.Drop(std::move(opened->call));
    return info.status();
  }
  info_ = *std::move(info);
  if (options_.parts.parts > 0 && opened->message.limits().max_parts() == 0) {
    connector_.Drop(std::move(opened->call));
    return absl::UnimplementedError("the server does not support frames in parts: use a newer one");
  }
  survives_ = options_.reconnect.give_up_after.count() > 0 && options_.checkpoint_interval > 0 &&
              (sends_other_part() || !opened->message.stream_token().empty());
  // A part other than 0 numbers its frames from 1 even if it joins late, because all parts number
  // frames by time step.
  checkpoint_next_ = next_answer_ =
      sends_other_part() ? 1 : std::max<std::uint64_t>(1, opened->message.next_sequence());
  resend_ = ResendBuffer(next_answer_);
  Adopt(*std::move(opened), info_.frames_in_flight);
  return absl::OkStatus();
}

absl::StatusOr<std::uint64_t> ResumingStream::Send(const Frame& frame, double time) {
  wire::FrameRows rows = wire::RowsOf(frame);
  rows.scalars.time = time;
  return SendRows(rows, frame.components < 1 ? 0 : frame.ParticleCount());
}

absl::StatusOr<std::uint64_t> ResumingStream::SendArrays(const ParticleArrays& particles,
                                                         double time) {
  const auto rows = RowsOf(particles, time);
  if (!rows.ok()) return rows.status();
  return SendRows(*rows, particles.count);
}

absl::StatusOr<std::uint64_t> ResumingStream::SendRows(const wire::FrameRows& frame,
                                                       std::size_t particles) {
  if (auto fits = CheckParticleCount(particles, info_.limits); !fits.ok()) return fits;
  const bool has_box = frame.scalars.box.has_value();
  const auto start = monitor_.Now();
  const MutexLock lock(monitor_.mutex);
  AssertShared();
  if (auto ready = WaitToSend(start, 0); !ready.ok()) return ready;
  const std::uint64_t sequence = resend_.end();
  absl::StatusOr<grpc::ByteBuffer> request;
  {
    const MutexUnlock unlock(monitor_.mutex);
    request = EncodeFrameRequest(frame, sequence, info_.limits);
  }
  if (!request.ok()) return request.status();
  if (auto ready = WaitToSend(start, request->Length()); !ready.ok()) return ready;
  if (has_box && !frame_boxes_) return BoxesNotSupported();
  if (all_answered()) due_since_ = monitor_.Now();
  sends_boxes_ = sends_boxes_ || has_box;
  resend_.Add(*request);
  if (call_ != nullptr) call_->Queue(*std::move(request));
  return sequence;
}

// Whether a frame of `bytes` bytes may be queued now.
bool ResumingStream::MaySend(std::uint64_t bytes) const {
  AssertShared();
  if (resend_.end() - next_answer_ >= info_.frames_in_flight) return false;
  if (resend_.bytes() + bytes > options_.max_held_bytes && !all_answered()) return false;
  // At most one frame waits in the call's queue. The queue of a lost call does not count.
  return call_ == nullptr || call_->reads_over() || call_->backlog() == 0;
}

// The status that ended the stream. Absent if the call continues, if it has responses that Take has
// not returned, or if a retry can succeed.
std::optional<absl::Status> ResumingStream::FatalEnd() const {
  AssertShared();
  if (call_ == nullptr || !call_->done() || call_->ready() > 0) return std::nullopt;
  Loss loss = LossOf(*call_, LossPurpose(options_));
  if (survives_ && loss.retryable) return std::nullopt;
  if (call_->end().ok() && !all_answered()) {
    return absl::UnavailableError(
        absl::StrCat("the server at ", call_->address(), " ended the stream and left ",
                     resend_.end() - next_answer_, " frames unanswered: start again"));
  }
  return std::move(loss.status);
}

absl::Status ResumingStream::WaitToSend(TimePoint start, std::uint64_t bytes) {
  const auto give_up = options_.send_timeout ? start + *options_.send_timeout : kNever;
  for (;;) {
    if (!failure_.ok()) return failure_;
    if (finished_) return absl::FailedPreconditionError("Send after FinishSending");
    if (auto end = FatalEnd()) return *std::move(end);
    if (MaySend(bytes)) break;
    const auto due = (call_ != nullptr ? std::max(start, adopted_at_)
                                       : start + options_.reconnect.give_up_after) +
                     options_.deadline;
    const auto now = monitor_.Now();
    if (now >= due) return Fail(TooSlowToSend());
    if (now >= give_up) return SendTimeout(*options_.send_timeout);
    monitor_.WaitUntil(std::min(due, give_up));
  }
  if (resend_.bytes() + bytes <= options_.max_held_bytes) return absl::OkStatus();
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {.reason = "HELD_BYTES",
       .field = "frame",
       .value = absl::StrCat(bytes, " bytes"),
       .rule = absl::StrCat("must fit into max_held_bytes, ", options_.max_held_bytes, ", beside ",
                            resend_.bytes(),
                            " held since the last checkpoint; increase max_held_bytes "
                            "or decrease checkpoint_interval")});
}

absl::Status ResumingStream::TooSlowToSend() const {
  AssertShared();
  const std::string deadline = Seconds(options_.deadline);
  if (call_ == nullptr || call_->ready() > 0 || call_->done()) {
    return absl::DeadlineExceededError(absl::StrCat(
        "no answer was received for ", deadline, " while ", call_ == nullptr ? 0 : call_->ready(),
        " waited: call Receive before or beside Send"));
  }
  return absl::DeadlineExceededError(absl::StrCat("the server at ", call_->address(),
                                                  " has taken no frame for ", deadline,
                                                  ": it may be overloaded; try again later"));
}

absl::Status ResumingStream::FinishSending() {
  const MutexLock lock(monitor_.mutex);
  AssertShared();
  if (!failure_.ok()) return failure_;
  if (finished_) return absl::OkStatus();
  if (auto end = FatalEnd()) return *std::move(end);
  finished_ = true;
  if (all_answered()) due_since_ = monitor_.Now();
  if (call_ != nullptr) call_->HalfClose();
  monitor_.changed.NotifyAll();
  return absl::OkStatus();
}

absl::StatusOr<Received> ResumingStream::Receive(Event& event,
                                                 std::optional<std::chrono::milliseconds> wait) {
  const auto until = wait ? OptionalTime(monitor_.Now() + *wait) : std::nullopt;
  const MutexLock lock(monitor_.mutex);
  auto received = Advance(event, until);
  if (!received.ok()) return Fail(received.status());
  return received;
}

absl::StatusOr<Received> ResumingStream::Advance(Event& event, OptionalTime until) {
  AssertShared();
  for (;;) {
    if (!failure_.ok()) return failure_;
    if (call_ == nullptr) {
      const auto gone_on = GoOn(until);
      if (!gone_on.ok()) return gone_on.status();
      if (!*gone_on) return Received::kNothingYet;
      continue;
    }
    if (std::exchange(owes_event_, false)) {
      event.kind = Event::Kind::kReconnected;
      event.sequence = 0;
      event.message = connector_.LossDescription();
      return Received::kEvent;
    }
    if (next_answer_ < over_below_) {
      event.kind = Event::Kind::kPartTaken;
      event.sequence = next_answer_++;
      monitor_.changed.NotifyAll();
      return Received::kEvent;
    }
    // A server that only sends notices is overdue, too.
    if (!call_->reads_over() && !call_->HasAnswer() && IsOverdue()) return TooSlowToAnswer();
    if (auto response = call_->Take()) {
      const auto delivered = Deliver(std::move(response), event);
      if (!delivered.ok()) return delivered.status();
      if (*delivered) return Received::kEvent;
      continue;
    }
    if (call_->done()) {
      const auto is_end = EndCall();
      if (!is_end.ok()) return is_end.status();
      if (*is_end) return Received::kEnd;
      continue;
    }
    const auto due = AnswerDue();
    const auto now = monitor_.Now();
    if (due && now >= *due) {
      if (call_->reads_over()) {
        return absl::DataLossError(absl::StrCat("an answer of the server at ", call_->address(),
                                                " cannot be read: it breaks the protocol"));
      }
      return TooSlowToAnswer();
    }
    if (until && now >= *until) return Received::kNothingYet;
    if (due || until) {
      monitor_.WaitUntil(std::min(due.value_or(kNever), until.value_or(kNever)));
    } else {
      monitor_.changed.Wait(monitor_.mutex);
    }
  }
}

ResumingStream::OptionalTime ResumingStream::AnswerDue() const {
  AssertShared();
  if (call_->reads_over()) return call_->progress_at() + kEndTimeout;
  if (all_answered() && !finished_) return std::nullopt;
  if (sends_other_part()) return std::nullopt;  // Its responses wait for part 0.
  return std::max(due_since_, call_->progress_at()) + options_.deadline;
}

bool ResumingStream::IsOverdue() const {
  AssertShared();
  const auto due = AnswerDue();
  return due && monitor_.Now() >= *due;
}

absl::Status ResumingStream::TooSlowToAnswer() const {
  AssertShared();
  return absl::DeadlineExceededError(absl::StrCat(
      "the server at ", call_->address(), " did not answer frame ", next_answer_, " within ",
      Seconds(options_.deadline), ": it may be overloaded; try again later"));
}

// Fills `event` and returns true if the caller must receive the response: an answer that is new to
// the caller, or a notice if the stream does not reconnect. Otherwise returns false.
absl::StatusOr<bool> ResumingStream::Deliver(StreamCall::Response response, Event& event) {
  AssertShared();
  const bool is_answer = IsAnswer(*response);
  const bool is_new = is_answer ? next_of_call_ == next_answer_ : !survives_;
  const std::uint64_t due = next_of_call_;
  const std::string& address = call_->address();  // Only the receiver's thread replaces the call.
  absl::Status status;
  {
    const MutexUnlock unlock(monitor_.mutex);
    if (response->has_notice()) connector_.Learn(response->notice());
    if (const auto sequence = AnsweredSequence(*response); is_answer && sequence != due) {
      status = absl::DataLossError(absl::StrCat("the server at ", address, " answered frame ",
                                                sequence, " where frame ", due,
                                                " was due: it breaks the protocol"));
    } else if (is_new || !is_answer) {
      status = DecodeAnswer(*response, address, scratch_, event);
    }
  }
  if (!status.ok()) return status;
  if (is_answer) {
    Remember(*response);
    ++next_of_call_;
    if (is_new) {
      ++next_answer_;
      connector_.Recovered();
    }
    if (!survives_) resend_.DropBelow(next_answer_);
  }
  call_->Recycle(std::move(response));
  monitor_.changed.NotifyAll();
  return is_new;
}

// Stores the checkpoint of `answer`. Drops the frames that it covers, which need not be resent.
void ResumingStream::Remember(const v1::ReconstructResponse& answer) {
  if (answer.has_part() && survives_) {
    checkpoint_next_ =
        std::max(checkpoint_next_, std::min(answer.part().resume_sequence(), next_of_call_ + 1));
    resend_.DropBelow(checkpoint_next_);
  }
  const std::string& checkpoint = answer.checkpoint();
  if (checkpoint.empty() || next_of_call_ < checkpoint_next_) return;
  checkpoint_ = checkpoint;
  checkpoint_next_ = next_of_call_ + 1;
  resend_.DropBelow(checkpoint_next_);
}

// Handles the end of the call. Returns true if the stream has ended, false if it reconnects.
absl::StatusOr<bool> ResumingStream::EndCall() {
  AssertShared();
  const Loss loss = LossOf(*call_, LossPurpose(options_));
  // Part 0 has finished.
  if (sends_other_part() && all_answered() && call_->end().ok()) finished_ = true;
  if (finished_ && all_answered() && (call_->end().ok() || (survives_ && loss.retryable))) {
    return true;
  }
  if (auto end = FatalEnd()) return *std::move(end);
  LoseCall(std::move(call_), loss);
  return false;
}

void ResumingStream::LoseCall(std::unique_ptr<StreamCall> call, const Loss& loss) {
  AssertShared();
  v1::ResumeStream resume;
  resume.set_checkpoint(checkpoint_);
  resume.set_stream_token(token_);
  connector_.Lost(loss, std::move(resume));
  monitor_.changed.NotifyAll();  // Wakes a sender that waits for the call's queue.
  connector_.Drop(std::move(call));
}

// Continues to reconnect. Returns false if no call is open by `until`.
absl::StatusOr<bool> ResumingStream::GoOn(OptionalTime until) {
  AssertShared();
  auto opened = connector_.OpenAgain(until);
  if (!opened.ok()) return opened.status();
  if (!*opened) return false;
  const auto info = ReadOpened((*opened)->message, options_.parameters);
  if (auto suits = info.ok() ? CheckReplica(**opened, *info) : info.status(); !suits.ok()) {
    LoseCall(std::move((*opened)->call), {.status = suits, .why = "does not suit"});
    return true;
  }
  owes_event_ = options_.reconnect.announce;
  Adopt(**std::move(opened), info->frames_in_flight);
  return true;
}

// Checks that the new server resumes after the checkpoint, with the same parameters and boxes of
// frames, and accepts frames that were sent under the first server's limits.
absl::Status ResumingStream::CheckReplica(const StreamConnector::Opened& opened,
                                          const StreamInfo& info) const {
  const std::string& address = opened.call->address();
  if (sends_other_part() ? opened.message.next_sequence() < checkpoint_next_
                         : opened.message.next_sequence() != checkpoint_next_) {
    return absl::DataLossError(absl::StrCat("the server at ", address, " goes on with frame ",
                                            opened.message.next_sequence(), " where frame ",
                                            checkpoint_next_, " was due"));
  }
  if (info.parameters != info_.parameters) {
    return absl::FailedPreconditionError(
        absl::StrCat("the server at ", address, " resolves the stream's parameters otherwise"));
  }
  if (sends_boxes_ && !info.frame_boxes) return BoxesNotSupported();
  const StreamLimits& limits = info.limits;
  if (AllowsAsMuch(limits.max_particles_per_frame, info_.limits.max_particles_per_frame) &&
      AllowsAsMuch(limits.max_frame_bytes, info_.limits.max_frame_bytes) &&
      AllowsAsMuch(limits.max_tiles_per_frame, info_.limits.max_tiles_per_frame)) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat("the server at ", address,
                   " has smaller limits than the first: give all servers of a stream the same"));
}

// Returns the number of the first frame to send through a new call. A part other than 0 does not
// resend its parts of frames that are already complete.
std::uint64_t ResumingStream::FirstToSend(const StreamConnector::Opened& opened) const {
  if (!sends_other_part()) return checkpoint_next_;
  return std::clamp(opened.message.next_sequence(), checkpoint_next_, resend_.end());
}

// Resends unanswered frames through the opened call and makes it the stream's call.
void ResumingStream::Adopt(StreamConnector::Opened opened, std::size_t window) {
  id_ = opened.message.stream_id();
  token_ = opened.message.stream_token();
  frame_boxes_ = opened.message.frame_boxes();
  next_of_call_ = FirstToSend(opened);
  over_below_ = next_of_call_;
  AssertShared();
  StreamCall& call = *opened.call;
  call.AssertLocked();
  call.SetWindow(window);
  // Until `call_` is set, the sender only adds frames to `resend_`, so the frames stay in order.
  for (std::uint64_t k = next_of_call_; k < resend_.end(); ++k) call.Queue(resend_.at(k));
  due_since_ = adopted_at_ = monitor_.Now();
  call_ = std::move(opened.call);
  if (all_answered()) connector_.Recovered();
  if (!failure_.ok()) call_->Cancel();
  if (finished_) call_->HalfClose();
  monitor_.changed.NotifyAll();
}

std::optional<Reconnecting> ResumingStream::reconnecting() const {
  const MutexLock lock(monitor_.mutex);
  return call_ == nullptr ? connector_.Progress() : std::nullopt;
}

std::string ResumingStream::CurrentId() const {
  const MutexLock lock(monitor_.mutex);
  return id_;
}

std::size_t ResumingStream::InFlight() const {
  const MutexLock lock(monitor_.mutex);
  return resend_.end() - next_answer_;
}

void ResumingStream::Cancel() {
  const MutexLock lock(monitor_.mutex);
  if (FatalEnd()) return;  // Keeps the status that ended the stream.
  Fail(absl::CancelledError("the stream was cancelled")).IgnoreError();
}

absl::Status ResumingStream::Fail(absl::Status failure) {
  AssertShared();
  if (failure_.ok()) failure_ = std::move(failure);
  connector_.Cancel();
  if (call_ != nullptr) call_->Cancel();
  monitor_.changed.NotifyAll();
  return failure_;
}

}  // namespace partiemc::client
