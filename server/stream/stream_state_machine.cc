#include "server/stream/stream_state_machine.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
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

absl::Status ClientGone() { return absl::CancelledError("the client went away"); }

}  // namespace

StreamStateMachine::StreamStateMachine(StreamTransport& transport, StreamHandler& handler,
                                       ComputePool& pool, MemoryBudget& budget, std::size_t window,
                                       std::shared_ptr<const CallerAccount> caller)
    : transport_(transport),
      handler_(handler),
      pool_(pool),
      budget_(budget),
      caller_(std::move(caller)),
      window_(std::max<std::size_t>(window, 1)),
      slot_bytes_(window_) {}

// Lets something happen to the state and does what follows from it.
template <typename Event>
void StreamStateMachine::On(Event event) {
  Actions actions;
  {
    const std::lock_guard lock(mutex_);
    event();
    actions = Decide();
  }
  Perform(std::move(actions));
}

void StreamStateMachine::Start(absl::Status admission) {
  On([&] {
    if (!admission.ok()) End(std::move(admission));
  });
}

void StreamStateMachine::ReadDone(RequestKind kind, std::uint64_t bytes) {
  bool open = false;
  On([&] {
    reading_ = false;
    counts_.last_activity = std::chrono::steady_clock::now();
    TakeRequest(kind, bytes);
    if (std::exchange(read_permit_, ReadPermit::kNone) == ReadPermit::kGiven) {
      absl::Status room = budget_.reads().Came(*this, bytes);
      const bool is_frame = kind == RequestKind::kFrame && phase_ == Phase::kStreaming;
      if (!room.ok() && is_frame && handler_.DropFrame((read_ - 1) % window_, room)) {
        SetSlotBytes(read_ - 1, 0);
      }
    }
    open = opening_;
  });
  if (!open) return;
  if (bytes <= kQuickOpenBytes) return Open();
  pool_.Submit([self = shared_from_this()](Worker&) { self->Open(); }, [] {}, nullptr,
               caller_.get());
}

void StreamStateMachine::TakeRequest(RequestKind kind, std::uint64_t bytes) {
  if (phase_ == Phase::kOpening) {
    opening_ = kind == RequestKind::kOpen;
    if (opening_) return SetSlotBytes(0, bytes);
    End(ProtocolError(Name(kind), "the first must be `open`"));
  } else if (phase_ == Phase::kStreaming) {
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

void StreamStateMachine::Open() {
  absl::Status status = cancelled_ ? ClientGone() : handler_.Open(0, *this);
  On([&] {
    opening_ = false;
    SetSlotBytes(0, 0);
    if (!status.ok()) {
      End(std::move(status));
    } else if (phase_ == Phase::kOpening) {
      phase_ = Phase::kStreaming;
      owes_opened_ = true;
    }
  });
}

void StreamStateMachine::ReadEnded() {
  On([&] {
    reading_ = false;
    End(phase_ == Phase::kOpening ? ProtocolError("none", "the first must be `open`")
                                  : absl::OkStatus());
  });
}

void StreamStateMachine::WriteDone(bool ok) {
  On([&] {
    writing_ = false;
    if (in_flight_ == Outgoing::kAnswer) SetSlotBytes(written_++, 0);
    counts_.last_activity = std::chrono::steady_clock::now();
    if (!ok) Abandon(ClientGone());
  });
}

void StreamStateMachine::Cancelled() {
  On([&] { Abandon(ClientGone()); });
}

void StreamStateMachine::Granted(std::uint64_t bytes) {
  On([&] {
    // What comes after the machine has gone on without it goes back at once.
    (waiting_ ? set_aside_ : surplus_) += bytes;
    waiting_ = false;
  });
}

void StreamStateMachine::ReadPermitted() {
  On([&] {
    if (read_permit_ == ReadPermit::kWaiting) read_permit_ = ReadPermit::kGiven;
  });
}

// The read brings what nothing has room for: it ends with the stream.
void StreamStateMachine::ReadRevoked(const absl::Status& status) {
  On([&] {
    if (!reading_ || phase_ != Phase::kStreaming) return;
    Abandon(status);
    owes_cut_ = writing_;
  });
}

void StreamStateMachine::TakenOver() {
  On([&] {
    // Of one that is over there is nothing to take, and no transport to cut any more.
    if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished) return;
    Abandon(ViolationError(absl::StatusCode::kAborted, {std::string(kReasonTakenOver), "stream",
                                                        "resumed by its producer in another call",
                                                        "must be read where it was resumed"}));
    owes_cut_ = writing_;  // Whoever takes no answers would keep it from ending.
  });
}

void StreamStateMachine::GiveWay(const absl::Status& status) {
  On([&] {
    if (phase_ == Phase::kOpening && !opening_) End(status);
  });
}

void StreamStateMachine::Drain() {
  On([&] {
    if (phase_ == Phase::kStreaming) owes_notice_ = true;
    if (phase_ == Phase::kOpening || phase_ == Phase::kStreaming) waits_for_none_ = true;
    End(DrainingError());
  });
}

void StreamStateMachine::LookAgain() {
  On([] {});
}

void StreamStateMachine::LeftOut(const absl::Status& status) {
  On([&] {
    if (!status.ok()) waits_for_none_ = true;
    if (phase_ == Phase::kOpening || phase_ == Phase::kStreaming) return End(status);
    if (phase_ == Phase::kEnding && status_.ok()) status_ = status;
  });
}

TimePoint StreamStateMachine::EndIfIdle(const IdleLimits& limits, TimePoint now) {
  TimePoint look_again = TimePoint::max();
  On([&] {
    if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished) return;
    // What a handler waits for it knows once it is open, and that may be at any time.
    const auto every = opening_ ? kLookWhileOpening : handler_.LookEvery();
    if (every > every.zero()) look_again = now + every;
    const auto limit = phase_ == Phase::kOpening ? limits.opening : limits.streaming;
    if (limit <= limit.zero()) {
      // An opening stream may come under the other limit at any time.
      if (phase_ == Phase::kOpening && limits.streaming > limit.zero()) {
        look_again = std::min(look_again, now + limits.streaming);
      }
      return;
    }
    const bool ours = opening_ || computing_ || computed_ < read_;
    const TimePoint due = (ours ? now : counts_.last_activity) + limit;
    if (now < due) {
      look_again = std::min(look_again, due);
    } else if (writing_) {
      Abandon(IdleError("takes no answer", limit));
      owes_cut_ = true;
    } else {
      End(IdleError(phase_ == Phase::kOpening ? "sends no `open`" : "sends no frame", limit));
    }
  });
  return look_again;
}

StreamCounts StreamStateMachine::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void StreamStateMachine::Compute(std::size_t slot, Worker& worker) {
  {
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kAbandoned) return;
  }
  answered_ = handler_.Answer(slot, worker, cancelled_);
}

void StreamStateMachine::Computed() {
  // Taken before any other frame can be computed.
  const std::optional<Answered> answered = std::exchange(answered_, std::nullopt);
  On([&] {
    computing_ = false;
    ++computed_;
    if (!answered) return;
    SetSlotBytes(computed_ - 1, answered->bytes);
    ++(answered->is_result ? counts_.frames : counts_.frame_errors);
    counts_.last_sequence = answered->last_sequence;
  });
  if (answered && answered->afterwards) answered->afterwards();
}

void StreamStateMachine::End(absl::Status status) {
  if (phase_ != Phase::kOpening && phase_ != Phase::kStreaming) return;
  phase_ = Phase::kEnding;
  status_ = std::move(status);
}

void StreamStateMachine::Abandon(absl::Status status) {
  if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished) return;
  phase_ = Phase::kAbandoned;
  status_ = std::move(status);
  cancelled_ = true;
}

// Counts what frame number `frame`, from 0, holds now instead of what it held before.
void StreamStateMachine::SetSlotBytes(std::uint64_t frame, std::uint64_t bytes) {
  std::uint64_t& held = slot_bytes_[frame % window_];
  if (bytes > held) {
    budget_.Take(bytes - held, caller_.get());
  } else {
    surplus_ += held - bytes;
  }
  held = bytes;
}

StreamStateMachine::Actions StreamStateMachine::Decide() {
  Actions actions;
  if (!opening_ && !reading_ && !starting_read_ && MayRead(actions)) {
    reading_ = starting_read_ = true;
    actions.read = read_ % window_;
  }
  const bool answers = phase_ == Phase::kStreaming || phase_ == Phase::kEnding;
  if (answers && MayCompute()) {
    computing_ = true;
    actions.compute = computed_ % window_;
    actions.compute_bytes = handler_.ComputedBytes(*actions.compute, slot_bytes_[*actions.compute]);
  }
  if (answers && !writing_) DecideWrite(actions);
  // Once finished there may be no transport any more.
  if (std::exchange(owes_cut_, false) && phase_ != Phase::kFinished) {
    actions.cut = cutting_ = true;
  }
  if (IsAllSaid() && !opening_ && !computing_ && !writing_ && !starting_read_ && !cutting_) {
    phase_ = Phase::kFinished;
    actions.finish = status_;
  }
  DecideMemory(actions);
  return actions;
}

bool StreamStateMachine::MayCompute() {
  return !computing_ && computed_ < read_ && handler_.MayAnswer(computed_ % window_);
}

bool StreamStateMachine::IsAllSaid() {
  if (phase_ == Phase::kAbandoned) return true;
  if (phase_ != Phase::kEnding || owes_notice_) return false;
  return written_ == read_ || (waits_for_none_ && written_ == computed_ && !computing_);
}

// Asked only when the next read could begin at once.
bool StreamStateMachine::MayRead(Actions& actions) {
  if (phase_ == Phase::kOpening) return true;
  if (phase_ != Phase::kStreaming || read_ - written_ >= window_) return false;
  if (read_ == written_) {
    actions.stop_waiting = std::exchange(waiting_, false);
    return HasReadPermit();
  }
  if (set_aside_ > 0) {
    PlanReadAhead();
    return true;
  }
  if (waiting_) return false;
  // Something is in flight, hence `last_bytes_` is known.
  if (budget_.TakeOrWait(last_bytes_, shared_from_this(), caller_.get())) {
    set_aside_ = last_bytes_;
    PlanReadAhead();
    return true;
  }
  waiting_ = true;
  return false;
}

// What was set aside is planned from now on, like all that reads can bring.
void StreamStateMachine::PlanReadAhead() {
  surplus_ += std::exchange(set_aside_, 0);
  budget_.reads().BeginNow(shared_from_this(), NextRead());
  read_permit_ = ReadPermit::kGiven;
}

bool StreamStateMachine::HasReadPermit() {
  if (read_permit_ == ReadPermit::kNone) {
    const bool given = budget_.reads().Begin(shared_from_this(), NextRead());
    read_permit_ = given ? ReadPermit::kGiven : ReadPermit::kWaiting;
  }
  return read_permit_ == ReadPermit::kGiven;
}

// A frame may be somewhat larger than the one before.
ReadPermits::Read StreamStateMachine::NextRead() const {
  const void* const assembly = handler_.Assembly();
  return {.stream = assembly != nullptr ? assembly : this,
          .expected_bytes = last_bytes_ + last_bytes_ / 8,
          .caller = caller_.get(),
          .peer = transport_.peer()};
}

// Room is set aside for a read only while the stream has something else in flight: what an idle
// stream reads next is planned only, and counted when it comes.
void StreamStateMachine::DecideMemory(Actions& actions) {
  if (phase_ != Phase::kStreaming && std::exchange(waiting_, false)) actions.stop_waiting = true;
  if (phase_ != Phase::kStreaming || read_ == written_) surplus_ += std::exchange(set_aside_, 0);
  const bool waits = phase_ != Phase::kStreaming && read_permit_ == ReadPermit::kWaiting;
  if (waits || phase_ == Phase::kFinished) {
    budget_.reads().End(*this);
    read_permit_ = ReadPermit::kNone;
  }
  if (phase_ == Phase::kFinished) {
    for (std::uint64_t& bytes : slot_bytes_) surplus_ += std::exchange(bytes, 0);
  }
  actions.give_back = std::exchange(surplus_, 0);
}

void StreamStateMachine::DecideWrite(Actions& actions) {
  if (owes_opened_) {
    owes_opened_ = false;
    actions.write = Outgoing::kOpened;
  } else if (owes_notice_) {
    owes_notice_ = false;
    actions.write = Outgoing::kDraining;
  } else if (written_ < computed_) {
    actions.write = Outgoing::kAnswer;
    actions.write_slot = written_ % window_;
  } else {
    return;
  }
  writing_ = true;
  in_flight_ = *actions.write;
}

void StreamStateMachine::Perform(Actions actions) {
  const auto self = shared_from_this();
  for (;;) {
    // Before anything that may end the stream elsewhere: it ends with nothing held.
    if (actions.stop_waiting) budget_.StopWaiting(self);
    if (actions.give_back > 0) budget_.GiveBack(actions.give_back, caller_.get());
    budget_.reads().Serve();
    if (actions.compute) {
      pool_.Submit([self, slot = *actions.compute](Worker& worker) { self->Compute(slot, worker); },
                   [self] { self->Computed(); }, &busy_mark_, caller_.get(), actions.compute_bytes);
    }
    if (actions.write) transport_.StartWrite(*actions.write, actions.write_slot);
    if (actions.cut) transport_.Cut();
    if (actions.finish) transport_.Finish(*actions.finish);
    if (!actions.read && !actions.cut) return;
    if (actions.read) transport_.StartRead(*actions.read);
    const std::lock_guard lock(mutex_);
    if (actions.read) starting_read_ = false;
    if (actions.cut) cutting_ = false;
    actions = Decide();
  }
}

}  // namespace partiemc::server
