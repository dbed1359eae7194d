#include "server/stream/unary_state_machine.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/stream/stream_state_machine.h"

namespace partiemc::server {
namespace {

using TimePoint = std::chrono::steady_clock::time_point;

absl::Status ClientGone() { return absl::CancelledError("the client went away"); }

absl::Status NoRequest() {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(kReasonMalformed), "request", "none", "must be one message"});
}

absl::Status NoRoom(FairShare::Fit fit, std::string field, std::uint64_t bytes,
                    std::uint64_t budget) {
  if (fit == FairShare::Fit::kMoreThanShare) return TooManyBytesOfCaller(bytes);
  return NoRoomInBudget(std::move(field), bytes, budget);
}

}  // namespace

// Lets something happen to the state and does what follows from it.
template <typename Event>
void UnaryStateMachine::On(Event event) {
  Actions actions;
  {
    const std::lock_guard lock(mutex_);
    event();
    actions = Decide();
  }
  Perform(std::move(actions));
}

void UnaryStateMachine::Start(absl::Status admission) {
  On([&] {
    owes_read_ = admission.ok() && phase_ == Phase::kReading;
    if (!admission.ok()) End(std::move(admission));
  });
}

void UnaryStateMachine::ReadDone(std::uint64_t bytes) {
  On([&] {
    if (phase_ != Phase::kReading) return;
    if (auto status = TakeBytes("request", bytes); !status.ok()) return End(std::move(status));
    phase_ = Phase::kWorking;
    owes_answer_ = true;
  });
}

void UnaryStateMachine::ReadEnded() {
  On([&] {
    if (phase_ == Phase::kReading) End(NoRequest());
  });
}

// What the call holds from now on.
absl::Status UnaryStateMachine::TakeBytes(std::string field, std::uint64_t bytes) {
  if (kind_ != UnaryKind::kFrame) {
    budget_.Take(bytes, caller_.get());
  } else if (const auto fit = budget_.TryTake(bytes, caller_.get()); fit != FairShare::Fit::kYes) {
    return NoRoom(fit, std::move(field), bytes, budget_.bytes());
  }
  held_bytes_ = bytes;
  return absl::OkStatus();
}

void UnaryStateMachine::Answer(Worker* worker) {
  absl::StatusOr<std::uint64_t> bytes = ClientGone();
  if (!cancelled_) bytes = transport_.Answer(worker);
  // The request is gone, so that its answer may have all that its caller may.
  On([&] { surplus_ += std::exchange(held_bytes_, 0); });
  On([&] {
    working_ = false;
    if (phase_ != Phase::kWorking) return;
    if (!bytes.ok()) return End(bytes.status());
    if (auto status = TakeBytes("answer", *bytes); !status.ok()) return End(std::move(status));
    phase_ = Phase::kWriting;
    phase_began_ = std::chrono::steady_clock::now();
    owes_write_ = true;
  });
}

void UnaryStateMachine::WriteDone(bool ok) {
  On([&] {
    writing_ = false;
    if (phase_ != Phase::kWriting) return;
    if (ok) {
      End(absl::OkStatus());
    } else {
      Abandon(ClientGone());
    }
  });
}

void UnaryStateMachine::Cancelled() {
  On([&] { Abandon(ClientGone()); });
}

void UnaryStateMachine::GiveWay(const absl::Status& status) {
  On([&] {
    if (phase_ == Phase::kReading) End(status);
  });
}

TimePoint UnaryStateMachine::EndIfIdle(const UnaryLimits& limits, TimePoint now) {
  TimePoint look_again = TimePoint::max();
  On([&] {
    if (phase_ != Phase::kReading && phase_ != Phase::kWriting) return;
    const auto limit = phase_ == Phase::kReading ? limits.request : limits.answer;
    if (limit <= limit.zero()) return;
    if (now < phase_began_ + limit) {
      look_again = phase_began_ + limit;
    } else if (phase_ == Phase::kReading) {
      End(IdleError("sends no request", limit));
    } else {
      Abandon(IdleError("takes no answer", limit));
      owes_cut_ = true;
    }
  });
  return look_again;
}

void UnaryStateMachine::End(absl::Status status) {
  if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished) return;
  phase_ = Phase::kEnding;
  status_ = std::move(status);
}

void UnaryStateMachine::Abandon(absl::Status status) {
  if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished) return;
  phase_ = Phase::kAbandoned;
  status_ = std::move(status);
  cancelled_ = true;
}

UnaryStateMachine::Actions UnaryStateMachine::Decide() {
  Actions actions;
  if (std::exchange(owes_read_, false)) actions.read = calling_ = true;
  if (std::exchange(owes_answer_, false)) {
    actions.answer = working_ = true;
    actions.answer_bytes = held_bytes_;
  }
  if (std::exchange(owes_write_, false) && phase_ == Phase::kWriting) {
    actions.write = writing_ = true;
  }
  const bool over = phase_ == Phase::kEnding || phase_ == Phase::kAbandoned;
  if (!calling_ && std::exchange(owes_cut_, false) && over) actions.cut = calling_ = true;
  if (over && !working_ && !writing_ && !calling_) {
    phase_ = Phase::kFinished;
    surplus_ += std::exchange(held_bytes_, 0);
    actions.finish = status_;
  }
  actions.give_back = std::exchange(surplus_, 0);
  return actions;
}

void UnaryStateMachine::Perform(Actions actions) {
  const auto self = shared_from_this();
  for (;;) {
    if (actions.give_back > 0) budget_.GiveBack(actions.give_back, caller_.get());
    if (actions.answer) {
      if (pool_ == nullptr) {
        Answer(nullptr);
      } else {
        pool_->Submit([self](Worker& worker) { self->Answer(&worker); }, [] {}, nullptr,
                      caller_.get(), actions.answer_bytes);
      }
    }
    if (actions.write) transport_.StartWrite();
    if (actions.cut) transport_.Cut();
    if (actions.finish) transport_.Finish(*actions.finish);
    if (!actions.read && !actions.cut) return;
    if (actions.read) transport_.StartRead();
    const std::lock_guard lock(mutex_);
    calling_ = false;
    actions = Decide();
  }
}

}  // namespace partiemc::server
