#include "server/watch/watch_state_machine.h"

#include <algorithm>
#include <utility>

#include "partiemc/status.h"
#include "server/base/call_errors.h"
#include "server/watch/result_broadcaster.h"

namespace partiemc::server {
namespace {

// The rule in the Violation for a watcher of an ended stream that pauses too long.
constexpr char kPausedRule[] =
    "must give credit and accept results within this time, once the stream has ended";

absl::Status WatcherGone() { return absl::CancelledError("the watcher went away"); }

}  // namespace

void WatchStateMachine::Start(absl::Status admission) {
  const Event event(*this);
  if (!admission.ok()) Refuse(std::move(admission));
}

void WatchStateMachine::ReadDone(const WatchRequest& request) {
  const Event event(*this);
  state_.reading = Reading::kIdle;
  TakeRequest(request);
}

void WatchStateMachine::TakeRequest(const WatchRequest& request) {
  using Kind = WatchRequest::Kind;
  if (state_.phase == Phase::kOpening) {
    if (request.kind != Kind::kOpen) {
      return Refuse(ProtocolError("no `open`", "the first must be `open`"));
    }
    state_.computing = Computing::kOpen;
    Do([this] { transport_.StartOpen(); });
  } else if (state_.phase != Phase::kServing && state_.phase != Phase::kEnding) {
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
    NoteMove();
  }
}

// Opens the watch. Joins the broadcaster before `opened` is written, so that the watcher misses no
// result that is published afterwards.
void WatchStateMachine::Opened(const absl::StatusOr<WatchTerms>& terms) {
  const Event event(*this);
  state_.computing = Computing::kIdle;
  if (!terms.ok()) return Refuse(terms.status());
  if (state_.phase != Phase::kOpening) return;
  state_.phase = Phase::kServing;
  mode_ = terms->mode;
  credit_ = terms->credit;
  Join(*terms);
}

void WatchStateMachine::Join(const WatchTerms& terms) {
  broadcaster_ = terms.broadcaster;
  const auto joined = broadcaster_->Join(shared_from_this(), terms.from_sequence);
  Write(Writing::kOpened, [this, held = joined.held] { transport_.WriteOpened(held); });
  if (joined.first.frame != nullptr) return Take(joined.first);
  offered_ = joined.last_number;
  next_held_ = joined.next_held;
  next_told_ = next_held_ != 0 ? next_held_ : offered_ + 1;
}

void WatchStateMachine::ReadEnded() {
  const Event event(*this);
  state_.reading = Reading::kEnded;
  if (state_.phase == Phase::kOpening && state_.computing == Computing::kIdle) {
    Refuse(ProtocolError("none", "the first must be `open`"));
  }
}

void WatchStateMachine::WriteDone(bool ok) {
  Published written;  // Freed without the lock.
  const Event event(*this);
  written = TakeInWrite();
  if (!ok) Abandon(WatcherGone());
}

void WatchStateMachine::WriteSkipped() {
  Published skipped;  // Freed without the lock.
  const Event event(*this);
  skipped = TakeBackWrite();
}

void WatchStateMachine::WriteRefused(const absl::Status& status) {
  Published refused;  // Freed without the lock.
  const Event event(*this);
  refused = TakeBackWrite();
  End(WatchEnd::With(status));
}

Published WatchStateMachine::TakeInWrite() {
  state_.writing = Writing::kIdle;
  NoteMove();
  if (in_write_.frame != nullptr) held_bytes_ -= in_write_.pending_bytes();
  return std::exchange(in_write_, {});
}

// Counts the frame in write as dropped, and returns its credit.
Published WatchStateMachine::TakeBackWrite() {
  ++credit_;
  --counts_.frames;
  ++counts_.dropped;
  next_told_ = told_before_;
  return TakeInWrite();
}

void WatchStateMachine::Cancelled() {
  const Event event(*this);
  Abandon(WatcherGone());
}

void WatchStateMachine::Offer(std::span<const Published> frames) {
  const Event event(*this);
  for (const Published& published : frames) {
    if (state_.phase != Phase::kServing) return;
    if (published.number <= offered_) continue;
    // The watcher is about to read this frame from the history, but the frame was too large for the
    // history. It exists only in this offer, so the watcher takes it from here.
    if (published.number == next_held_ && !IsHeld(next_held_)) CatchUp();
    if (next_held_ == 0) {
      Take(published);
    } else {
      offered_ = published.number;
    }
  }
}

void WatchStateMachine::Take(const Published& published) {
  if (offered_ == 0) next_told_ = published.number;
  const std::uint64_t missed = offered_ == 0 ? 0 : published.number - offered_ - 1;
  const bool is_lost = missed > 0 && published.last_loss > offered_;
  offered_ = published.number;
  counts_.dropped += missed;
  const std::size_t bytes = published.pending_bytes();
  if (bytes > max_bytes_) {
    ++counts_.dropped;
    return End(WatchEnd::TooLarge(published.frame->bytes(), max_bytes_));
  }
  if (mode_ == WatchMode::kLatest) {
    DropPending();
  } else if (missed > 0 || held_bytes_ + bytes > max_bytes_) {
    if (missed == 0 && LeaveToHistory(published)) return;
    ++counts_.dropped;
    if (is_lost) {
      return BeginEnding(WatchEnd::ResultsLost(missed));
    }
    return End(WatchEnd::FellBehind(pending_.size() + missed + 1, held_bytes_ + bytes, max_bytes_));
  }
  pending_.push_back(published);
  held_bytes_ += bytes;
  counts_.most_held_bytes = std::max(counts_.most_held_bytes, held_bytes_);
}

bool WatchStateMachine::IsHeld(std::uint64_t number) const {
  return broadcaster_->Held(number).number == number;
}

// If the history contains all pending frames and the new frame `published`, drops the pending
// frames and returns true. The watcher then reads all of them from the history.
bool WatchStateMachine::LeaveToHistory(const Published& published) {
  const std::uint64_t first = pending_.empty() ? published.number : pending_.front().number;
  if (!IsHeld(first)) return false;
  for (const Published& left : pending_) held_bytes_ -= left.pending_bytes();
  pending_.clear();
  next_held_ = first;
  return true;
}

// Makes the next frame of the history pending, if the client has given credit.
void WatchStateMachine::TakeHeld() {
  Published held = broadcaster_->Held(next_held_);
  if (held.number != next_held_) {
    if (next_held_ > offered_) return CatchUp();  // It will be offered.
    // The history has dropped the frame. If the watcher has not received any frame yet, it starts
    // with the oldest remaining frame.
    if (mode_ == WatchMode::kEvery && counts_.frames > 0) {
      return End(WatchEnd::NoLongerHeld(offered_ + 1 - next_held_));
    }
    MissUntil(held.frame != nullptr ? held.number : offered_ + 1);
    if (held.frame == nullptr) return CatchUp();
  }
  if (held.pending_bytes() > max_bytes_) {
    return End(WatchEnd::TooLarge(held.frame->bytes(), max_bytes_));
  }
  if (credit_ == 0) return;
  ++next_held_;
  held_bytes_ += held.pending_bytes();
  counts_.most_held_bytes = std::max(counts_.most_held_bytes, held_bytes_);
  pending_.push_back(std::move(held));
}

// The watcher has read the whole history. From now on it takes the frames that are offered.
void WatchStateMachine::CatchUp() {
  offered_ = std::max(offered_, next_held_ - 1);
  next_held_ = 0;
}

void WatchStateMachine::MissUntil(std::uint64_t number) {
  counts_.dropped += number - next_held_;
  next_held_ = number;
}

void WatchStateMachine::StreamEnded(const WatchEnd& end) {
  const Event event(*this);
  if (state_.phase != Phase::kServing) return;
  if (next_held_ == 0 && offered_ != 0 && end.last_number > offered_) {
    counts_.dropped += end.last_number - offered_;
    offered_ = end.last_number;
  }
  if (!end.status.ok()) return End(end);
  BeginEnding(end);
}

void WatchStateMachine::Drain() {
  const Event event(*this);
  Refuse(DrainingError());
  End(WatchEnd::With(DrainingError()));
}

std::chrono::steady_clock::time_point WatchStateMachine::EndIfSilent(
    std::chrono::milliseconds limit, std::chrono::steady_clock::time_point now) {
  const Event event(*this);
  const bool waits = state_.phase == Phase::kOpening && state_.computing == Computing::kIdle;
  if (!waits || limit <= limit.zero()) return std::chrono::steady_clock::time_point::max();
  if (now < came_ + limit) return came_ + limit;
  Refuse(IdleError("sends no `open`", limit));
  return std::chrono::steady_clock::time_point::max();
}

std::chrono::steady_clock::time_point WatchStateMachine::EndIfPaused(
    const PauseLimits& limits, std::chrono::steady_clock::time_point now) {
  const Event event(*this);
  const bool writes = state_.writing != Writing::kIdle;
  const bool ends = state_.phase == Phase::kEnding || state_.phase == Phase::kClosing;
  const auto limit = writes ? limits.write : limits.pause;
  if (!ends || limit <= limit.zero()) return std::chrono::steady_clock::time_point::max();
  if (now < moved_ + limit) return moved_ + limit;
  if (writes) {
    Abandon(IdleError("takes no result", limit, kPausedRule));
    Do([this] { transport_.Cut(); });
  } else {
    End(WatchEnd::With(IdleError("gives no credit", limit, kPausedRule)));
  }
  return std::chrono::steady_clock::time_point::max();
}

void WatchStateMachine::GiveWay(const absl::Status& status) {
  const Event event(*this);
  if (state_.computing == Computing::kIdle) Refuse(status);
}

void WatchStateMachine::GiveUp(const absl::Status& status) {
  const Event event(*this);
  if (!IsOpen()) return;
  Abandon(status);
  if (state_.writing != Writing::kIdle) Do([this] { transport_.Cut(); });
}

void WatchStateMachine::Cut() {
  const Event event(*this);
  if (state_.phase == Phase::kFinished) return;
  Abandon(WatcherGone());
  Do([this] { transport_.Cut(); });
}

WatchCounts WatchStateMachine::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

std::size_t WatchStateMachine::held_bytes() const {
  const MutexLock lock(mutex_);
  return held_bytes_;
}

bool WatchStateMachine::goes_back() const {
  const MutexLock lock(mutex_);
  return next_held_ != 0;
}

void WatchStateMachine::DropPending() {
  counts_.dropped += pending_.size();
  for (const Published& dropped : pending_) held_bytes_ -= dropped.pending_bytes();
  pending_.clear();
  if (next_held_ == 0) return;
  MissUntil(std::max(next_held_, offered_ + 1));
  CatchUp();
}

void WatchStateMachine::BeginEnding(WatchEnd end) {
  state_.phase = Phase::kEnding;
  end_ = std::move(end);
  NoteMove();
}

// Ends an open watch. Drops its pending frames instead of waiting for credit.
void WatchStateMachine::End(WatchEnd end) {
  if (state_.phase != Phase::kServing && state_.phase != Phase::kEnding) return;
  BeginEnding(std::move(end));
  DropPending();
}

// Restarts the time of EndIfPaused.
void WatchStateMachine::NoteMove() {
  if (state_.phase == Phase::kEnding) moved_ = std::chrono::steady_clock::now();
}

// Ends a watch that is not open yet. The client receives only a status, no message.
void WatchStateMachine::Refuse(absl::Status status) {
  if (state_.phase != Phase::kOpening) return;
  state_.phase = Phase::kClosing;
  end_ = WatchEnd::With(std::move(status));
}

void WatchStateMachine::Abandon(absl::Status status) {
  if (state_.phase == Phase::kAbandoned || state_.phase == Phase::kFinished) return;
  state_.phase = Phase::kAbandoned;
  end_.status = std::move(status);
  DropPending();
}

bool WatchStateMachine::IsOpen() const {
  return state_.phase == Phase::kServing || state_.phase == Phase::kEnding ||
         state_.phase == Phase::kClosing;
}

void WatchStateMachine::Decide() {
  const bool writes = state_.writing != Writing::kIdle;
  if (state_.reading == Reading::kEnded && credit_ == 0) {
    if (state_.phase == Phase::kServing && !writes) {
      End({std::string(kReasonCreditUsed), "half-closed, and all credit is used", {}});
    }
    if (state_.phase == Phase::kEnding) DropPending();
  }
  if (!writes) DecideWrite();
  const bool is_busy = state_.computing != Computing::kIdle || state_.writing != Writing::kIdle;
  if ((state_.phase == Phase::kAbandoned || state_.phase == Phase::kClosing) && !is_busy) {
    state_.phase = Phase::kFinished;
    if (broadcaster_ != nullptr) {
      Do([this, left = std::exchange(broadcaster_, nullptr)] { left->Leave(*this); });
    }
    Do([this, status = end_.status] { transport_.Finish(status); });
  }
  const bool reads = state_.phase == Phase::kOpening || IsOpen();
  if (reads && state_.reading == Reading::kIdle && state_.computing == Computing::kIdle) {
    state_.reading = state_.phase == Phase::kOpening ? Reading::kFirst : Reading::kNext;
    Do([this] { transport_.StartRead(); });
  }
}

void WatchStateMachine::DecideWrite() {
  if (state_.phase != Phase::kServing && state_.phase != Phase::kEnding) return;
  if (next_held_ != 0) TakeHeld();
  if (!pending_.empty() && credit_ > 0) {
    WriteFrame();
  } else if (state_.phase == Phase::kEnding && pending_.empty() && next_held_ == 0) {
    state_.phase = Phase::kClosing;
    const std::uint64_t dropped = offered_ == 0 ? 0 : offered_ + 1 - next_told_;
    Write(Writing::kNotice, [this, end = end_, dropped] { transport_.WriteEnded(end, dropped); });
  }
}

void WatchStateMachine::WriteFrame() {
  --credit_;
  ++counts_.frames;
  in_write_ = std::move(pending_.front());
  pending_.pop_front();
  const std::uint64_t dropped = in_write_.number - next_told_;
  told_before_ = next_told_;
  next_told_ = in_write_.number + 1;
  Write(Writing::kResult,
        [this, frame = in_write_, dropped, oldest = broadcaster_->oldest_sequence()] {
          transport_.WriteFrame(frame, dropped, oldest);
        });
}

void WatchStateMachine::Write(Writing what, Action action) {
  state_.writing = what;
  Do(std::move(action));
}

}  // namespace partiemc::server
