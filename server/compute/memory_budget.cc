#include "server/compute/memory_budget.h"

#include <set>
#include <utility>
#include <vector>

namespace partiemc::server {
namespace {

using Fit = FairShare::Fit;

std::uint64_t MostOf(const CallerAccount* caller) {
  return caller == nullptr ? FairShare::kNoLimit
                           : caller->quota().bytes.value_or(FairShare::kNoLimit);
}

}  // namespace

void MemoryBudget::Take(std::uint64_t bytes, const CallerAccount* caller) {
  const std::lock_guard lock(mutex_);
  share_.Take(caller, bytes);
}

// Whether nobody who came before is to have it first.
Fit MemoryBudget::FitsNow(const Claim& claim) const {
  for (const Claim& before : claims_) {
    const Fit fit = Fits(before);
    if (fit == Fit::kNoRoom || before.caller == claim.caller) {
      return fit == Fit::kMoreThanShare ? fit : Fit::kNoRoom;
    }
  }
  return Fits(claim);
}

Fit MemoryBudget::TryTake(std::uint64_t bytes, const CallerAccount* caller) {
  const std::uint64_t most = MostOf(caller);
  const std::lock_guard lock(mutex_);
  const Fit fit = FitsNow({{}, bytes, caller, most});
  if (fit == Fit::kYes) share_.Take(caller, bytes);
  if (fit == Fit::kNoRoom) TellShortage();
  return fit;
}

bool MemoryBudget::TakeOrWait(std::uint64_t bytes, const std::shared_ptr<Waiter>& waiter,
                              const CallerAccount* caller) {
  Claim claim{waiter, bytes, caller, MostOf(caller)};
  const std::lock_guard lock(mutex_);
  const Fit fit = FitsNow(claim);
  const bool fits = fit == Fit::kYes;
  if (fits) {
    share_.Take(caller, bytes);
  } else {
    claims_.push_back(std::move(claim));
    if (fit == Fit::kNoRoom) TellShortage();
  }
  return fits;
}

void MemoryBudget::StopWaiting(const std::shared_ptr<Waiter>& waiter) {
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(claims_, [&](const Claim& claim) {
      return !claim.waiter.owner_before(waiter) && !waiter.owner_before(claim.waiter);
    });
  }
  Grant();  // It may have stood before somebody who wants less.
}

void MemoryBudget::GiveBack(std::uint64_t bytes, const CallerAccount* caller) {
  {
    const std::lock_guard lock(mutex_);
    share_.GiveBack(caller, bytes);
  }
  Grant();
}

void MemoryBudget::Grant() {
  std::vector<std::pair<std::shared_ptr<Waiter>, std::uint64_t>> granted;
  {
    const std::lock_guard lock(mutex_);
    std::set<const CallerAccount*> waiting;  // Callers whose first claim has to wait.
    for (auto claim = claims_.begin(); claim != claims_.end();) {
      auto waiter = claim->waiter.lock();
      const Fit fit = waiter == nullptr ? Fit::kYes : Fits(*claim);
      if (fit == Fit::kNoRoom) {
        TellShortage();
        break;
      }
      if (fit == Fit::kMoreThanShare) waiting.insert(claim->caller);
      if (waiter != nullptr && waiting.contains(claim->caller)) {
        ++claim;
        continue;
      }
      if (waiter != nullptr) {
        share_.Take(claim->caller, claim->bytes);
        granted.emplace_back(std::move(waiter), claim->bytes);
      }
      claim = claims_.erase(claim);
    }
  }
  for (const auto& [waiter, bytes] : granted) waiter->Granted(bytes);
}

void MemoryBudget::TellShortage() const {
  if (tell_shortage_) tell_shortage_();
}

void MemoryBudget::OnShortage(std::function<void()> tell) {
  const std::lock_guard lock(mutex_);
  tell_shortage_ = std::move(tell);
}

std::uint64_t MemoryBudget::held() const {
  const std::lock_guard lock(mutex_);
  return share_.held();
}

}  // namespace partiemc::server
