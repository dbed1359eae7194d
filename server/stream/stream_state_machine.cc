#include "server/stream/stream_state_machine.h"

#include <algorithm>
#include <string>
#include <utility>

#include "partiemc/status.h"

namespace partiemc::server {
namespace {

using TimePoint = std::chrono::steady_clock::time_point;

std::string Name(RequestKind kind) {
  switch (kind) {
    case RequestKind::kMalformed:
      return "malformed";
    case RequestKind::kEmpty:
      return "empty";
    case RequestKind::kOpen:
      return "open";
    case RequestKind::kFrame:
      return "frame";
  }
  return "";
}

constexpr std::chrono::milliseconds kLookWhileOpening(100);

constexpr char kIdleStreamRule[] =
    "must do so within this time (Limits.idle_timeout_seconds); open a new stream";

}  // namespace

StreamStateMachine::StreamStateMachine(StreamTransport& transport, StreamHandler& handler,
                                       ComputePool& pool, MemoryBudget& budget, std::size_t window,
                                       std::shared_ptr<const CallerAccount> caller)
    : SerializedCall(MachineKind::kStream),
      transport_(transport),
      handler_(handler),
      pool_(pool),
      budget_(budget),
      caller_(std::move(caller)),
      window_(std::max<std::size_t>(window, 1)),
      slot_bytes_(window_) {}

void StreamStateMachine::Start(absl::Status admission) {
  const Event event(*this);
  if (!admission.ok()) End(std::move(admission));
}

void StreamStateMachine::PartArrives() {
  const Event event(*this);
  part_arrives_ = true;
}

void StreamStateMachine::ReadDone(RequestKind kind, std::uint64_t bytes) {
  const Event event(*this);
  const bool had_permit = state_.reading == Reading::kNext;
  state_.reading = Reading::kIdle;
  counts_.last_activity = std::chrono::steady_clock::now();
  const std::uint64_t read_before = read_;
  TakeRequest(kind, bytes);
  part_arrives_ = false;
  if (!had_permit) return;
  const absl::Status room = budget_.reads().Came(*this, bytes);
  if (!room.ok() && read_ != read_before && handler_.DropFrame((read_ - 1) % window_, room)) {
    SetSlotBytes(read_ - 1, 0);
  }
}

void StreamStateMachine::TakeRequest(RequestKind kind, std::uint64_t bytes) {
  if (state_.phase == Phase::kOpening) {
    if (kind == RequestKind::kOpen) return OpenLater(bytes);
    End(ProtocolError(Name(kind), "the first must be `open`"));
  } else if (state_.phase == Phase::kServing || (part_arrives_ && state_.phase == Phase::kEnding)) {
    switch (kind) {
      case RequestKind::kFrame:
        last_bytes_ = std::max<std::uint64_t>(bytes, 1);
        SetSlotBytes(read_++, bytes);
        break;
      case RequestKind::kOpen:
        End(ProtocolError(Name(kind), "comes once; after it every request must be `frame`"));
        break;
      case RequestKind::kMalformed:
      case RequestKind::kEmpty:
        End(ProtocolError(Name(kind), "must be `frame`"));
        break;
    }
  }
}

void StreamStateMachine::OpenLater(std::uint64_t bytes) {
  state_.computing = Computing::kOpen;
  SetSlotBytes(0, bytes);
  if (bytes <= kQuickOpenBytes) return Do([this] { Open(); });
  Do([this] {
    pool_.Submit([self = shared_from_this()](Worker&) { self->Open(); }, [] {}, nullptr,
                 caller_.get());
  });
}

void StreamStateMachine::Open() {
  absl::Status status = cancelled_ ? ClientGone() : handler_.Open(0, *this);
  const Event event(*this);
  state_.computing = Computing::kIdle;
  SetSlotBytes(0, 0);
  if (!status.ok()) {
    End(std::move(status));
  } else if (state_.phase == Phase::kOpening) {
    state_.phase = Phase::kServing;
    Write(Writing::kOpened);
  }
}

void StreamStateMachine::ReadEnded() {
  const Event event(*this);
  state_.reading = Reading::kEnded;
  End(state_.phase == Phase::kOpening ? ProtocolError("none", "the first must be `open`")
                                      : absl::OkStatus());
}

void StreamStateMachine::WriteDone(bool ok) {
  const Event event(*this);
  const Writing written = std::exchange(state_.writing, Writing::kIdle);
  if (written == Writing::kResult || written == Writing::kResultThenNotice) {
    SetSlotBytes(written_++, 0);
  }
  counts_.last_activity = std::chrono::steady_clock::now();
  if (!ok) return Abandon(ClientGone());
  const bool owes_notice =
      written == Writing::kOpenedThenNotice || written == Writing::kResultThenNotice;
  if (owes_notice && state_.phase != Phase::kAbandoned) Write(Writing::kNotice);
}

void StreamStateMachine::Cancelled() {
  const Event event(*this);
  Abandon(ClientGone());
}

void StreamStateMachine::Granted(std::uint64_t bytes) {
  const Event event(*this);
  surplus_ += bytes;  // Returned, because the read's permit plans the bytes.
  if (state_.reading == Reading::kMemory) ReadAhead();
}

void StreamStateMachine::ReadPermitted() {
  const Event event(*this);
  if (state_.reading != Reading::kPermit) return;
  counts_.last_activity = std::chrono::steady_clock::now();  // The client's time begins again.
  Read(Reading::kNext);
}

// Ends a stream whose read in progress exceeds the memory (ReadPermits). Abandoning the stream also
// makes the pending read fail.
void StreamStateMachine::ReadRevoked(const absl::Status& status) {
  const Event event(*this);
  if (state_.reading == Reading::kNext && state_.phase == Phase::kServing) AbandonAndCut(status);
}

void StreamStateMachine::TakenOver() {
  const Event event(*this);
  if (state_.phase == Phase::kAbandoned || state_.phase == Phase::kFinished) return;
  AbandonAndCut(ViolationError(
      absl::StatusCode::kAborted,
      {std::string(kReasonTakenOver), "stream", "resumed by its producer in another call",
       "must be read where it was resumed"}));
}

void StreamStateMachine::GiveWay(const absl::Status& status) {
  const Event event(*this);
  if (state_.phase == Phase::kOpening && state_.computing == Computing::kIdle) End(status);
}

void StreamStateMachine::Drain() {
  const Event event(*this);
  if (state_.phase == Phase::kServing) {
    switch (state_.writing) {
      case Writing::kOpened:
        state_.writing = Writing::kOpenedThenNotice;
        break;
      case Writing::kResult:
        state_.writing = Writing::kResultThenNotice;
        break;
      default:
        Write(Writing::kNotice);
    }
  }
  End(DrainingError(), Phase::kClosing);
}

void StreamStateMachine::LookAgain() { const Event event(*this); }

void StreamStateMachine::LeftOut(const absl::Status& status) {
  const Event event(*this);
  End(status, status.ok() ? Phase::kEnding : Phase::kClosing);
  if (status.ok() || state_.phase != Phase::kEnding) return;
  state_.phase = Phase::kClosing;
  if (status_.ok()) status_ = status;
}

TimePoint StreamStateMachine::EndIfIdle(const IdleLimits& limits, TimePoint now) {
  const Event event(*this);
  TimePoint look_again = TimePoint::max();
  if (state_.phase == Phase::kAbandoned || state_.phase == Phase::kFinished) return look_again;
  const bool opens = state_.computing == Computing::kOpen;
  const auto every = opens ? kLookWhileOpening : handler_.LookEvery();
  if (every > every.zero()) look_again = now + every;
  const bool is_opening = state_.phase == Phase::kOpening;
  const auto limit = is_opening ? limits.opening : limits.streaming;
  if (limit <= limit.zero()) {
    // There is no limit for the current phase. The stream may begin to serve at any time; then the
    // streaming limit applies.
    if (is_opening && limits.streaming > limit.zero()) {
      look_again = std::min(look_again, now + limits.streaming);
    }
    return look_again;
  }
  const bool waits_for_permit =
      state_.reading == Reading::kPermit && state_.writing == Writing::kIdle;
  const bool waits_for_us = opens || computed_ < read_ || waits_for_permit;
  const TimePoint due = (waits_for_us ? now : counts_.last_activity) + limit;
  if (now < due) return std::min(look_again, due);
  if (state_.writing != Writing::kIdle) {
    AbandonAndCut(IdleError("takes no answer", limit, kIdleStreamRule));
  } else {
    End(is_opening ? IdleError("sends no `open`", limit)
                   : IdleError("sends no frame", limit, kIdleStreamRule));
  }
  return look_again;
}

StreamCounts StreamStateMachine::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

void StreamStateMachine::Compute(std::size_t slot, Worker& worker) {
  if (state().phase == Phase::kAbandoned) return;
  answered_ = handler_.Answer(slot, worker, cancelled_);
}

void StreamStateMachine::Computed() {
  // Takes answered_ first: after the event below, another thread may compute the next frame and set
  // answered_ again.
  std::optional<Answered> answered = std::exchange(answered_, std::nullopt);
  {
    const Event event(*this);
    state_.computing = Computing::kIdle;
    ++computed_;
    if (!answered) return;
    SetSlotBytes(computed_ - 1, answered->bytes);
    if (answered->is_result) {
      ++counts_.frames;
    } else if (!answered->is_cancelled) {
      ++counts_.frame_errors;
    }
    counts_.last_sequence = answered->last_sequence;
  }
  if (!answered->afterwards) return;
  const Event event(*this);  // A second event, so that its action runs after the write's action.
  Do(std::move(answered->afterwards));
}

void StreamStateMachine::End(absl::Status status, Phase phase) {
  if (state_.phase != Phase::kOpening && state_.phase != Phase::kServing) return;
  state_.phase = phase;
  status_ = std::move(status);
}

void StreamStateMachine::Abandon(absl::Status status) {
  if (state_.phase == Phase::kAbandoned || state_.phase == Phase::kFinished) return;
  state_.phase = Phase::kAbandoned;
  status_ = std::move(status);
  cancelled_ = true;
}

// Abandons the stream and cuts a pending write. Without the cut, a client that does not read would
// keep the stream from ending.
void StreamStateMachine::AbandonAndCut(absl::Status status) {
  Abandon(std::move(status));
  if (state_.writing != Writing::kIdle) Do([this] { transport_.Cut(); });
}

// Sets the number of bytes that frame number `frame` (counted from 0) holds in the budget.
void StreamStateMachine::SetSlotBytes(std::uint64_t frame, std::uint64_t bytes) {
  std::uint64_t& held = slot_bytes_[frame % window_];
  if (bytes > held) {
    budget_.Take(bytes - held, caller_.get());
  } else {
    surplus_ += held - bytes;
  }
  held = bytes;
}

void StreamStateMachine::Decide() {
  DecideMemory();
  DecideRead();
  DecideCompute();
  const bool answers = state_.phase == Phase::kServing || state_.phase == Phase::kEnding ||
                       state_.phase == Phase::kClosing;
  if (answers && state_.writing == Writing::kIdle && written_ < computed_) Write(Writing::kResult);
  DecideFinish();
}

// Releases memory and cancels waits. Decide calls this first, so that the stream holds no memory
// when a later action ends it.
void StreamStateMachine::DecideMemory() {
  const bool serves = state_.phase == Phase::kServing;
  if (state_.reading == Reading::kMemory && (!serves || read_ == written_)) {
    state_.reading = Reading::kIdle;
    Do([this] { budget_.StopWaiting(shared_from_this()); });
  }
  if (state_.reading == Reading::kPermit && !serves) {
    state_.reading = Reading::kIdle;
    budget_.reads().End(*this);
  }
  Do([this] { ReturnMemory(); });
}

void StreamStateMachine::ReturnMemory() {
  std::uint64_t bytes = 0;
  {
    const MutexLock lock(mutex_);
    bytes = std::exchange(surplus_, 0);
  }
  if (bytes > 0) budget_.GiveBack(bytes, caller_.get());
  budget_.reads().Serve();
}

void StreamStateMachine::DecideRead() {
  if (state_.reading != Reading::kIdle || state_.computing == Computing::kOpen) return;
  if (state_.phase == Phase::kOpening) return Read(Reading::kFirst);
  if (state_.phase != Phase::kServing || read_ - written_ >= window_) return;
  if (read_ == written_) {
    const bool permitted = budget_.reads().Begin(shared_from_this(), NextRead());
    permitted ? Read(Reading::kNext) : void(state_.reading = Reading::kPermit);
    return;
  }
  if (!budget_.reads().MayReadAhead(*this)) return;
  // At least the last size, even if it exceeds ReadTerms::message_bytes.
  const std::uint64_t bytes = std::max(last_bytes_, budget_.reads().PlannedBytes(ExpectedBytes()));
  if (budget_.TakeOrWait(bytes, shared_from_this(), caller_.get())) {
    surplus_ += bytes;
    ReadAhead();
  } else {
    state_.reading = Reading::kMemory;
  }
}

// Reads another frame while frames are in flight. The caller has checked that the bytes fit into
// the budget, so the read need not wait for a permit.
void StreamStateMachine::ReadAhead() {
  budget_.reads().BeginNow(shared_from_this(), NextRead());
  Read(Reading::kNext);
}

void StreamStateMachine::Read(Reading what) {
  state_.reading = what;
  Do([this, slot = read_ % window_] { transport_.StartRead(slot); });
}

// The next frame is expected to be at most an eighth larger than the last one.
std::uint64_t StreamStateMachine::ExpectedBytes() const { return last_bytes_ + last_bytes_ / 8; }

ReadPermits::Read StreamStateMachine::NextRead() const {
  const void* const assembly = handler_.Assembly();
  return {.stream = assembly != nullptr ? assembly : this,
          .expected_bytes = ExpectedBytes(),
          .caller = caller_.get(),
          .peer = transport_.peer()};
}

void StreamStateMachine::DecideCompute() {
  const bool answers = state_.phase == Phase::kServing || state_.phase == Phase::kEnding ||
                       state_.phase == Phase::kClosing;
  const std::size_t slot = computed_ % window_;
  if (!answers || state_.computing != Computing::kIdle || computed_ == read_ ||
      !handler_.MayAnswer(slot)) {
    return;
  }
  state_.computing = Computing::kResult;
  Do([this, slot, bytes = handler_.ComputedBytes(slot, slot_bytes_[slot])] {
    pool_.Submit([self = shared_from_this(), slot](Worker& worker) { self->Compute(slot, worker); },
                 [self = shared_from_this()] { self->Computed(); }, &busy_mark_, caller_.get(),
                 bytes);
  });
}

void StreamStateMachine::Write(Writing what) {
  state_.writing = what;
  counts_.last_activity = std::chrono::steady_clock::now();  // The frame's time in the server ends.
  const Outgoing outgoing = what == Writing::kOpened   ? Outgoing::kOpened
                            : what == Writing::kNotice ? Outgoing::kDraining
                                                       : Outgoing::kAnswer;
  const std::size_t slot = outgoing == Outgoing::kAnswer ? written_ % window_ : 0;
  Do([this, outgoing, slot] { transport_.StartWrite(outgoing, slot); });
}

void StreamStateMachine::DecideFinish() {
  if (!IsAllSaid() || state_.computing != Computing::kIdle || state_.writing != Writing::kIdle) {
    return;
  }
  state_.phase = Phase::kFinished;
  budget_.reads().End(*this);
  for (std::uint64_t& bytes : slot_bytes_) surplus_ += std::exchange(bytes, 0);
  Do([this, status = status_] { transport_.Finish(status); });
}

bool StreamStateMachine::IsAllSaid() const {
  switch (state_.phase) {
    case Phase::kAbandoned:
      return true;
    case Phase::kEnding:
      return written_ == read_ && !part_arrives_;
    case Phase::kClosing:
      return written_ == computed_;
    default:
      return false;
  }
}

}  // namespace partiemc::server
