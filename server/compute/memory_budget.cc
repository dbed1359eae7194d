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
Fit MemoryBudget::FitsNow(const Wish& wish) const {
  for (const Wish& before : wishes_) {
    const Fit fit = Fits(before);
    if (fit == Fit::kNoRoom || before.caller == wish.caller) {
      return fit == Fit::kMoreThanShare ? fit : Fit::kNoRoom;
    }
  }
  return Fits(wish);
}

Fit MemoryBudget::TryTake(std::uint64_t bytes, const CallerAccount* caller) {
  const std::uint64_t most = MostOf(caller);
  const std::lock_guard lock(mutex_);
  const Fit fit = FitsNow({{}, bytes, caller, most});
  if (fit == Fit::kYes) share_.Take(caller, bytes);
  if (fit != Fit::kYes && tell_shortage_) tell_shortage_();
  return fit;
}

bool MemoryBudget::TakeOrWait(std::uint64_t bytes, const std::shared_ptr<Waiter>& waiter,
                              const CallerAccount* caller) {
  Wish wish{waiter, bytes, caller, MostOf(caller)};
  const std::lock_guard lock(mutex_);
  const bool fits = FitsNow(wish) == Fit::kYes;
  if (fits) {
    share_.Take(caller, bytes);
  } else {
    wishes_.push_back(std::move(wish));
    if (tell_shortage_) tell_shortage_();
  }
  return fits;
}

void MemoryBudget::StopWaiting(const std::shared_ptr<Waiter>& waiter) {
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(wishes_, [&](const Wish& wish) {
      return !wish.waiter.owner_before(waiter) && !waiter.owner_before(wish.waiter);
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
    std::set<const CallerAccount*> waiting;  // Callers whose first wish has to wait.
    for (auto wish = wishes_.begin(); wish != wishes_.end();) {
      auto waiter = wish->waiter.lock();
      const Fit fit = waiter == nullptr ? Fit::kYes : Fits(*wish);
      if (fit == Fit::kNoRoom) break;
      if (fit == Fit::kMoreThanShare) waiting.insert(wish->caller);
      if (waiter != nullptr && waiting.contains(wish->caller)) {
        ++wish;
        continue;
      }
      if (waiter != nullptr) {
        share_.Take(wish->caller, wish->bytes);
        granted.emplace_back(std::move(waiter), wish->bytes);
      }
      wish = wishes_.erase(wish);
    }
  }
  for (const auto& [waiter, bytes] : granted) waiter->Granted(bytes);
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
