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
  Add(std::move(call)).kind = kind;
  return absl::OkStatus();
}

absl::Status UnaryRegistry::TakePlace(const UnaryStateMachine& call, const CallerAccount& caller) {
  const MutexLock lock(mutex_);
  Entry& entry = entries_.at(&call);
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
  const auto found = entries_.find(&call);
  if (found == entries_.end()) return;  // The call was not admitted.
  Entry& entry = found->second;
  if (entry.caller != nullptr) places_[IndexOf(entry.kind)].GiveBack(entry.caller, 1);
  entry.caller = nullptr;
}

void UnaryRegistry::Leave(const UnaryStateMachine& call) {
  const MutexLock lock(mutex_);
  FreePlace(call);  // A request that arrives while the call ends may have taken a slot.
  Remove(call);
}

std::size_t UnaryRegistry::count() const {
  const MutexLock lock(mutex_);
  return entries_.size();
}

std::chrono::steady_clock::time_point UnaryRegistry::EndIdle(
    const UnaryLimits& limits, std::chrono::steady_clock::time_point now) {
  return EndLate([&](UnaryStateMachine& call) { return call.EndIfIdle(limits, now); });
}

void UnaryRegistry::Drain() {
  StopAdmitting();
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
      entries_, [](const auto& call) { return call.second.kind == UnaryKind::kFrame; });
}

}  // namespace partiemc::server
