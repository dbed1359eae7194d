#include "server/watch/watch_state_machine.h"

#include <algorithm>
#include <utility>

#include "partiemc/status.h"
#include "server/base/call_errors.h"
#include "server/watch/result_broadcaster.h"

namespace partiemc::server {
namespace {

absl::Status WatcherGone() { return absl::CancelledError("the watcher went away"); }

}  // namespace

// Applies an event to the state under the lock, then performs the resulting actions without it.
template <typename Event>
void WatchStateMachine::On(Event event) {
  Actions actions;
  {
    const std::lock_guard lock(mutex_);
    event();
    actions = Decide();
  }
  Perform(std::move(actions));
}

void WatchStateMachine::Start(absl::Status admission) {
  On([&] {
    if (!admission.ok()) Refuse(std::move(admission));
  });
}

void WatchStateMachine::ReadDone(const WatchRequest& request) {
  bool open = false;
  On([&] {
    reading_ = false;
    TakeRequest(request);
    open = opening_;
  });
  if (open) transport_.StartOpen();
}

void WatchStateMachine::TakeRequest(const WatchRequest& request) {
  using Kind = WatchRequest::Kind;
  if (phase_ == Phase::kOpening) {
    opening_ = request.kind == Kind::kOpen;
    if (!opening_) Refuse(ProtocolError("no `open`", "the first must be `open`"));
  } else if (phase_ != Phase::kWatching && phase_ != Phase::kEnding) {
    return;
  } else if (request.kind != Kind::kCredit) {
    End(WatchEnd::With(ProtocolError(request.kind == Kind::kOpen ? "open" : "no `credit`",
                                     "after the first every request must be `credit`")));
  } else if (request.credit == 0) {
    End(WatchEnd::With(ViolationError(
        absl::StatusCode::kInvalidArgument,
        {std::string(kReasonOutOfRange), "credit.frames", "0", "must be at least 1"})));
  } else {
    credit_ += request.credit;
  }
}

// Joins before `opened` is written, so that the watcher misses no result published afterwards.
// Nothing is written and nothing ends before that.
void WatchStateMachine::Opened(const absl::StatusOr<WatchTerms>& terms) {
  On([&] {
    opening_ = false;
    if (!terms.ok()) {
      Refuse(terms.status());
    } else if (phase_ == Phase::kOpening) {
      phase_ = Phase::kWatching;
      owes_opened_ = true;
      mode_ = terms->mode;
      credit_ = terms->credit;
      keeps_history_ = terms->keeps_history;
      Join(*terms);
    }
  });
}

void WatchStateMachine::Join(const WatchTerms& terms) {
  broadcaster_ = terms.broadcaster;
  const auto joined = broadcaster_->Join(shared_from_this(), terms.from_sequence);
  held_ = joined.held;
  if (joined.first.frame != nullptr) return Take(joined.first);
  offered_ = joined.last_number;
  next_held_ = joined.next_held;
  next_told_ = next_held_ != 0 ? next_held_ : offered_ + 1;
}

void WatchStateMachine::ReadEnded() {
  On([&] {
    reading_ = false;
    half_closed_ = true;
    if (phase_ == Phase::kOpening && !opening_) {
      Refuse(ProtocolError("none", "the first must be `open`"));
    }
  });
}

void WatchStateMachine::WriteDone(bool ok) {
  Published written;  // Freed without the lock.
  On([&] {
    writing_ = false;
    if (in_write_.frame != nullptr) held_bytes_ -= in_write_.frame->bytes() + kPublishedBytes;
    written = std::exchange(in_write_, {});
    if (!ok) Abandon(WatcherGone());
  });
}

void WatchStateMachine::Cancelled() {
  On([&] { Abandon(WatcherGone()); });
}

void WatchStateMachine::Offer(std::span<const Published> frames) {
  On([&] {
    for (const Published& published : frames) {
      if (phase_ != Phase::kWatching) return;
      if (published.number <= offered_) continue;
      // A frame that does not fit into the history is only offered.
      if (published.number == next_held_ && !IsHeld(next_held_)) CatchUp();
      if (next_held_ == 0) {
        Take(published);
      } else {
        offered_ = published.number;
      }
    }
  });
}

void WatchStateMachine::Take(const Published& published) {
  if (offered_ == 0) next_told_ = published.number;
  const std::uint64_t missed = offered_ == 0 ? 0 : published.number - offered_ - 1;
  offered_ = published.number;
  counts_.dropped += missed;
  const std::size_t bytes = published.frame->bytes() + kPublishedBytes;
  if (bytes > max_bytes_) {
    ++counts_.dropped;
    return End(WatchEnd::TooLarge(published.frame->bytes(), max_bytes_));
  }
  if (mode_ == WatchMode::kLatest) {
    DropPending();
  } else if (missed > 0 || held_bytes_ + bytes > max_bytes_) {
    if (missed == 0 && LeaveToHistory(published)) return;
    ++counts_.dropped;
    return End(WatchEnd::FellBehind(pending_.size() + missed + 1, held_bytes_ + bytes, max_bytes_));
  }
  pending_.push_back(published);
  held_bytes_ += bytes;
  counts_.most_held_bytes = std::max(counts_.most_held_bytes, held_bytes_);
}

bool WatchStateMachine::IsHeld(std::uint64_t number) const {
  return broadcaster_->Held(number).number == number;
}

// Drops the pending frames if the history has all of them, to read them there later.
bool WatchStateMachine::LeaveToHistory(const Published& published) {
  const std::uint64_t first = pending_.empty() ? published.number : pending_.front().number;
  if (!IsHeld(first)) return false;
  for (const Published& left : pending_) held_bytes_ -= left.frame->bytes() + kPublishedBytes;
  pending_.clear();
  next_held_ = first;
  return true;
}

// Makes the next frame of the history pending if there is credit.
void WatchStateMachine::TakeHeld() {
  Published held = broadcaster_->Held(next_held_);
  if (held.number != next_held_) {
    if (next_held_ > offered_) return CatchUp();  // It will be offered.
    // Before its first frame a watcher starts with the oldest remaining frame.
    if (mode_ == WatchMode::kEvery && counts_.frames > 0) {
      return End(WatchEnd::NoLongerHeld(offered_ + 1 - next_held_));
    }
    MissUntil(held.frame != nullptr ? held.number : offered_ + 1);
    if (held.frame == nullptr) return CatchUp();
  }
  if (held.frame->bytes() + kPublishedBytes > max_bytes_) {
    return End(WatchEnd::TooLarge(held.frame->bytes(), max_bytes_));
  }
  if (credit_ == 0) return;
  ++next_held_;
  held_bytes_ += held.frame->bytes() + kPublishedBytes;
  counts_.most_held_bytes = std::max(counts_.most_held_bytes, held_bytes_);
  pending_.push_back(std::move(held));
}

// The watcher has read the whole history; the next frame will be offered.
void WatchStateMachine::CatchUp() {
  offered_ = std::max(offered_, next_held_ - 1);
  next_held_ = 0;
}

void WatchStateMachine::MissUntil(std::uint64_t number) {
  counts_.dropped += number - next_held_;
  next_held_ = number;
}

void WatchStateMachine::StreamEnded(const WatchEnd& end) {
  On([&] {
    if (phase_ != Phase::kWatching) return;
    if (next_held_ == 0 && offered_ != 0 && end.last_number > offered_) {
      counts_.dropped += end.last_number - offered_;
      offered_ = end.last_number;
    }
    if (end.status.ok()) {
      phase_ = Phase::kEnding;
      end_ = end;
      owes_ended_ = true;
    } else {
      End(end);
    }
  });
}

void WatchStateMachine::Drain() {
  On([&] {
    if (phase_ == Phase::kOpening) Refuse(DrainingError());
    if (phase_ == Phase::kWatching || phase_ == Phase::kEnding)
      End(WatchEnd::With(DrainingError()));
  });
}

std::chrono::steady_clock::time_point WatchStateMachine::EndIfSilent(
    std::chrono::milliseconds limit, std::chrono::steady_clock::time_point now) {
  auto look_again = std::chrono::steady_clock::time_point::max();
  On([&] {
    if (phase_ != Phase::kOpening || opening_ || limit <= limit.zero()) return;
    if (now < came_ + limit) {
      look_again = came_ + limit;
    } else {
      Refuse(IdleError("sends no `open`", limit));
    }
  });
  return look_again;
}

void WatchStateMachine::GiveWay(const absl::Status& status) {
  On([&] {
    if (phase_ == Phase::kOpening && !opening_) Refuse(status);
  });
}

void WatchStateMachine::GiveUp(const absl::Status& status) {
  bool cut = false;
  On([&] {
    if (phase_ != Phase::kWatching && phase_ != Phase::kEnding) return;
    cut = writing_;
    Abandon(status);
  });
  if (cut) Cut();
}

void WatchStateMachine::Cut() {
  {
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kFinished || cutting_) return;
    cutting_ = true;
  }
  transport_.Cut();
  On([&] {
    cutting_ = false;
    Abandon(WatcherGone());
  });
}

WatchCounts WatchStateMachine::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::size_t WatchStateMachine::held_bytes() const {
  const std::lock_guard lock(mutex_);
  return held_bytes_;
}

bool WatchStateMachine::goes_back() const {
  const std::lock_guard lock(mutex_);
  return next_held_ != 0 || keeps_history_;
}

void WatchStateMachine::DropPending() {
  counts_.dropped += pending_.size();
  for (const Published& dropped : pending_) held_bytes_ -= dropped.frame->bytes() + kPublishedBytes;
  pending_.clear();
  if (next_held_ == 0) return;
  MissUntil(std::max(next_held_, offered_ + 1));
  CatchUp();
}

// Drops pending frames instead of waiting for credit.
void WatchStateMachine::End(WatchEnd end) {
  if (phase_ == Phase::kEnding && !owes_ended_) return;  // Another end has been sent.
  phase_ = Phase::kEnding;
  end_ = std::move(end);
  owes_ended_ = true;
  DropPending();
}

// Ends a watch that is not open yet by its status alone.
void WatchStateMachine::Refuse(absl::Status status) {
  if (phase_ != Phase::kOpening) return;
  phase_ = Phase::kEnding;
  end_ = WatchEnd::With(std::move(status));
}

void WatchStateMachine::Abandon(absl::Status status) {
  if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished) return;
  phase_ = Phase::kAbandoned;
  end_.status = std::move(status);
  DropPending();
}

WatchStateMachine::Actions WatchStateMachine::Decide() {
  Actions actions;
  const bool no_more_credit = half_closed_ && credit_ == 0;
  if (no_more_credit && phase_ == Phase::kWatching && !writing_) {
    End({std::string(kReasonCreditUsed), "half-closed, and all credit is used", {}});
  }
  if (no_more_credit && phase_ == Phase::kEnding) DropPending();
  const bool open = phase_ == Phase::kWatching || phase_ == Phase::kEnding;
  if ((phase_ == Phase::kOpening || open) && !half_closed_ && !opening_ && !reading_ &&
      !starting_read_) {
    actions.read = reading_ = starting_read_ = true;
  }
  if (open && !writing_ && !opening_) DecideWrite(actions);
  const bool all_said =
      phase_ == Phase::kAbandoned || (phase_ == Phase::kEnding && !owes_ended_ && !owes_opened_);
  if (all_said && !opening_ && !writing_ && !starting_read_ && !cutting_) {
    phase_ = Phase::kFinished;
    actions.finish = end_.status;
    actions.leave = std::exchange(broadcaster_, nullptr);
  }
  return actions;
}

void WatchStateMachine::DecideWrite(Actions& actions) {
  if (!owes_opened_ && next_held_ != 0) TakeHeld();
  if (owes_opened_) {
    owes_opened_ = false;
    actions.write = Write::kOpened;
    actions.held = held_;
  } else if (!pending_.empty() && credit_ > 0) {
    --credit_;
    ++counts_.frames;
    actions.write = Write::kFrame;
    in_write_ = std::move(pending_.front());
    pending_.pop_front();
    actions.frame = in_write_;
    actions.dropped = in_write_.number - next_told_;
    actions.oldest_sequence = broadcaster_->oldest_sequence();
    next_told_ = in_write_.number + 1;
  } else if (owes_ended_ && pending_.empty() && next_held_ == 0) {
    owes_ended_ = false;
    actions.write = Write::kEnded;
    actions.end = end_;
    actions.dropped = offered_ == 0 ? 0 : offered_ + 1 - next_told_;
  } else {
    return;
  }
  writing_ = true;
}

void WatchStateMachine::Perform(Actions actions) {
  const auto self = shared_from_this();
  for (;;) {
    if (actions.write) {
      switch (*actions.write) {
        case Write::kOpened:
          transport_.WriteOpened(actions.held);
          break;
        case Write::kFrame:
          transport_.WriteFrame(actions.frame, actions.dropped, actions.oldest_sequence);
          break;
        case Write::kEnded:
          transport_.WriteEnded(actions.end, actions.dropped);
          break;
      }
    }
    if (actions.leave != nullptr) actions.leave->Leave(*this);
    if (actions.finish) transport_.Finish(*actions.finish);
    if (!actions.read) return;
    transport_.StartRead();
    const std::lock_guard lock(mutex_);
    starting_read_ = false;
    actions = Decide();
  }
}

}  // namespace partiemc::server
