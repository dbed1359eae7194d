#include "server/stream/unary_registry.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/stream/stream_state_machine.h"

namespace partiemc::server {
namespace {

std::size_t IndexOf(UnaryKind kind) { return static_cast<std::size_t>(kind); }

absl::Status TooMany(UnaryKind kind, const FairShare& places, const CallerAccount& caller) {
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonTooManyCalls),
       kind == UnaryKind::kFrame   ? "calls of ReconstructFrame"
       : kind == UnaryKind::kProbe ? "health checks"
                                   : "calls for information",
       absl::StrCat(places.held(), " going on, ", places.held_by(&caller), " of this caller"),
       absl::StrCat("must be at most ", places.room(),
                    ", and of one caller no more than are free; try again later")});
}

}  // namespace

absl::Status UnaryRegistry::Enter(std::shared_ptr<UnaryStateMachine> call, UnaryKind kind) {
  const MutexLock lock(mutex_);
  if (draining_ && kind == UnaryKind::kFrame) return DrainingError();
  const UnaryStateMachine* key = call.get();
  calls_[key] = {std::move(call), kind};
  return absl::OkStatus();
}

absl::Status UnaryRegistry::TakePlace(const UnaryStateMachine& call, const CallerAccount& caller) {
  const MutexLock lock(mutex_);
  Entry& entry = calls_.at(&call);
  FairShare& places = places_[IndexOf(entry.kind)];
  if (places.Fits(&caller, 1) != FairShare::Fit::kYes) return TooMany(entry.kind, places, caller);
  places.Take(&caller, 1);
  entry.caller = &caller;
  return absl::OkStatus();
}

void UnaryRegistry::GiveBackPlace(const UnaryStateMachine& call) {
  const MutexLock lock(mutex_);
  FreePlace(call);
}

void UnaryRegistry::FreePlace(const UnaryStateMachine& call) {
  const auto found = calls_.find(&call);
  if (found == calls_.end()) return;  // The call was not admitted.
  Entry& entry = found->second;
  if (entry.caller != nullptr) places_[IndexOf(entry.kind)].GiveBack(entry.caller, 1);
  entry.caller = nullptr;
}

void UnaryRegistry::Leave(const UnaryStateMachine& call) {
  const MutexLock lock(mutex_);
  FreePlace(call);  // A request that arrives while the call ends may have taken a slot.
  calls_.erase(&call);
  // Holds the lock, because a thread in WaitForFrames may destroy the registry afterwards.
  left_.NotifyAll();
}

std::size_t UnaryRegistry::count() const {
  const MutexLock lock(mutex_);
  return calls_.size();
}

std::chrono::steady_clock::time_point UnaryRegistry::EndIdle(
    const UnaryLimits& limits, std::chrono::steady_clock::time_point now) {
  auto look_again = std::chrono::steady_clock::time_point::max();
  // Without the lock, because a call that ends may call Leave.
  for (const auto& call : All()) look_again = std::min(look_again, call->EndIfIdle(limits, now));
  return look_again;
}

std::vector<std::shared_ptr<UnaryStateMachine>> UnaryRegistry::All() const {
  std::vector<std::shared_ptr<UnaryStateMachine>> all;
  const MutexLock lock(mutex_);
  for (const auto& [key, entry] : calls_) all.push_back(entry.call);
  return all;
}

// Ends the calls without the lock, because a call that ends may call Leave.
void UnaryRegistry::Drain() {
  {
    const MutexLock lock(mutex_);
    draining_ = true;
  }
  for (const auto& call : All()) call->GiveWay(DrainingError());
}

bool UnaryRegistry::WaitForFrames(std::chrono::steady_clock::time_point deadline) {
  const MutexLock lock(mutex_);
  while (HasFrames() && left_.WaitUntil(mutex_, deadline)) {
  }
  return !HasFrames();
}

bool UnaryRegistry::HasFrames() const {
  return std::ranges::any_of(
      calls_, [](const auto& call) { return call.second.kind == UnaryKind::kFrame; });
}

}  // namespace partiemc::server
