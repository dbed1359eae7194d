#include "server/memory_budget.h"

#include <utility>
#include <vector>

namespace partiemc::server {

void MemoryBudget::Take(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  held_ += bytes;
}

bool MemoryBudget::TryTake(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (!wishes_.empty() || !HasRoom(bytes)) return false;
  held_ += bytes;
  return true;
}

bool MemoryBudget::TakeOrWait(std::uint64_t bytes, const std::shared_ptr<Waiter>& waiter) {
  const std::lock_guard lock(mutex_);
  if (wishes_.empty() && HasRoom(bytes)) {
    held_ += bytes;
    return true;
  }
  wishes_.push_back({waiter, bytes});
  return false;
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

void MemoryBudget::GiveBack(std::uint64_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    held_ -= bytes;
  }
  Grant();
}

void MemoryBudget::Grant() {
  std::vector<std::pair<std::shared_ptr<Waiter>, std::uint64_t>> granted;
  {
    const std::lock_guard lock(mutex_);
    while (!wishes_.empty() && HasRoom(wishes_.front().bytes)) {
      if (auto waiter = wishes_.front().waiter.lock()) {
        held_ += wishes_.front().bytes;
        granted.emplace_back(std::move(waiter), wishes_.front().bytes);
      }
      wishes_.pop_front();
    }
  }
  for (const auto& [waiter, bytes] : granted) waiter->Granted(bytes);
}

std::uint64_t MemoryBudget::held() const {
  const std::lock_guard lock(mutex_);
  return held_;
}

}  // namespace partiemc::server
