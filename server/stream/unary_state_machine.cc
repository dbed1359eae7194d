#include "server/stream/unary_state_machine.h"

#include <string>
#include <utility>

#include "partiemc/status.h"
#include "server/base/call_errors.h"

namespace partiemc::server {
namespace {

using TimePoint = std::chrono::steady_clock::time_point;

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

UnaryStateMachine::UnaryStateMachine(UnaryTransport& transport, MemoryBudget& budget,
                                     ComputePool* pool, std::shared_ptr<const CallerAccount> caller,
                                     UnaryKind kind)
    : SerializedCall(MachineKind::kUnary),
      transport_(transport),
      budget_(budget),
      pool_(pool),
      caller_(std::move(caller)),
      kind_(kind) {}

void UnaryStateMachine::Start(absl::Status admission) {
  const Event event(*this);
  if (!admission.ok()) End(std::move(admission));
}

void UnaryStateMachine::ReadDone(std::uint64_t bytes) {
  const Event event(*this);
  state_.reading = Reading::kIdle;
  if (state_.phase != Phase::kOpening) return;
  if (auto status = TakeBytes("request", bytes); !status.ok()) return End(std::move(status));
  state_.phase = Phase::kServing;
  state_.computing = Computing::kResult;
  Do([this, bytes] { StartAnswer(bytes); });
}

void UnaryStateMachine::ReadEnded() {
  const Event event(*this);
  state_.reading = Reading::kEnded;
  if (state_.phase == Phase::kOpening) End(NoRequest());
}

absl::Status UnaryStateMachine::TakeBytes(std::string field, std::uint64_t bytes) {
  if (kind_ != UnaryKind::kFrame) {
    budget_.Take(bytes, caller_.get());
  } else if (const auto fit = budget_.TryTake(bytes, caller_.get()); fit != FairShare::Fit::kYes) {
    return NoRoom(fit, std::move(field), bytes, budget_.bytes());
  }
  held_bytes_ = bytes;
  return absl::OkStatus();
}

void UnaryStateMachine::ReturnMemory() {
  std::uint64_t bytes = 0;
  {
    const MutexLock lock(mutex_);
    bytes = std::exchange(held_bytes_, 0);
  }
  if (bytes > 0) budget_.GiveBack(bytes, caller_.get());
}

void UnaryStateMachine::StartAnswer(std::uint64_t bytes) {
  if (pool_ == nullptr) return Answer(nullptr);
  pool_->Submit([self = shared_from_this()](Worker& worker) { self->Answer(&worker); }, [] {},
                nullptr, caller_.get(), bytes);
}

void UnaryStateMachine::Answer(Worker* worker) {
  absl::StatusOr<std::uint64_t> bytes = ClientGone();
  if (!cancelled_) bytes = transport_.Answer(worker);
  ReturnMemory();  // The response may use the memory of its request.
  const Event event(*this);
  state_.computing = Computing::kIdle;
  if (state_.phase != Phase::kServing) return;
  if (!bytes.ok()) return End(bytes.status());
  if (auto status = TakeBytes("answer", *bytes); !status.ok()) return End(std::move(status));
  began_ = std::chrono::steady_clock::now();
  state_.writing = Writing::kResult;
  Do([this] { transport_.StartWrite(); });
}

void UnaryStateMachine::WriteDone(bool ok) {
  const Event event(*this);
  state_.writing = Writing::kIdle;
  ok ? End(absl::OkStatus()) : End(ClientGone(), Phase::kAbandoned);
}

void UnaryStateMachine::Cancelled() {
  const Event event(*this);
  End(ClientGone(), Phase::kAbandoned);
}

void UnaryStateMachine::GiveWay(const absl::Status& status) {
  const Event event(*this);
  if (state_.phase == Phase::kOpening) End(status);
}

TimePoint UnaryStateMachine::EndIfIdle(const UnaryLimits& limits, TimePoint now) {
  const Event event(*this);
  const bool reads = state_.phase == Phase::kOpening;
  const bool writes = state_.phase == Phase::kServing && state_.writing == Writing::kResult;
  const auto limit = reads ? limits.request : limits.answer;
  if ((!reads && !writes) || limit <= limit.zero()) return TimePoint::max();
  if (now < began_ + limit) return began_ + limit;
  if (reads) {
    End(IdleError("sends no request", limit));
  } else {
    End(IdleError("takes no answer", limit), Phase::kAbandoned);
    Do([this] { transport_.Cut(); });
  }
  return TimePoint::max();
}

void UnaryStateMachine::End(absl::Status status, Phase phase) {
  if (state_.phase == Phase::kAbandoned || state_.phase == Phase::kFinished) return;
  state_.phase = phase;
  status_ = std::move(status);
  if (phase == Phase::kAbandoned) cancelled_ = true;
}

void UnaryStateMachine::Decide() {
  if (state_.phase == Phase::kOpening && state_.reading == Reading::kIdle) {
    state_.reading = Reading::kFirst;
    Do([this] { transport_.StartRead(); });
  }
  const bool is_over = state_.phase == Phase::kEnding || state_.phase == Phase::kAbandoned;
  const bool is_busy = state_.computing != Computing::kIdle || state_.writing != Writing::kIdle;
  if (!is_over || is_busy) return;
  state_.phase = Phase::kFinished;
  Do([this] { ReturnMemory(); });
  Do([this, status = status_] { transport_.Finish(status); });
}

}  // namespace partiemc::server
