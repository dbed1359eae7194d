#include "server/compute/memory_budget.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

using Fit = FairShare::Fit;

}  // namespace

std::uint64_t QuotaOf(const CallerAccount* caller) {
  return caller == nullptr ? FairShare::kNoLimit
                           : caller->quota().bytes.value_or(FairShare::kNoLimit);
}

absl::Status NoRoomInBudget(std::string field, std::uint64_t bytes, std::uint64_t budget) {
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonMemoryBudget), std::move(field), absl::StrCat(bytes, " bytes"),
       absl::StrCat("must fit with what is being worked on into ", budget,
                    " bytes; try again later, or start the server with a larger "
                    "--memory-budget")});
}

void MemoryBudget::Take(std::uint64_t bytes, const CallerAccount* caller) {
  const MutexLock lock(mutex_);
  share_.Take(caller, bytes);
  held_ += bytes;
}

// Like Fits, but also returns an error if the claim must wait behind an earlier claim.
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
  const std::uint64_t most = QuotaOf(caller);
  const MutexLock lock(mutex_);
  const Fit fit = FitsNow({{}, bytes, caller, most});
  if (fit == Fit::kYes) {
    share_.Take(caller, bytes);
    held_ += bytes;
  }
  if (fit == Fit::kNoRoom) TellShortage();
  return fit;
}

bool MemoryBudget::TakeOrWait(std::uint64_t bytes, const std::shared_ptr<Waiter>& waiter,
                              const CallerAccount* caller) {
  Claim claim{waiter, bytes, caller, QuotaOf(caller)};
  const MutexLock lock(mutex_);
  const Fit fit = FitsNow(claim);
  const bool fits = fit == Fit::kYes;
  if (fits) {
    share_.Take(caller, bytes);
    held_ += bytes;
  } else {
    claims_.push_back(std::move(claim));
    if (fit == Fit::kNoRoom) TellShortage();
  }
  return fits;
}

void MemoryBudget::StopWaiting(const std::shared_ptr<Waiter>& waiter) {
  {
    const MutexLock lock(mutex_);
    std::erase_if(claims_, [&](const Claim& claim) {
      return !claim.waiter.owner_before(waiter) && !waiter.owner_before(claim.waiter);
    });
  }
  Grant();  // The removed claim may have blocked a smaller one.
}

void MemoryBudget::GiveBack(std::uint64_t bytes, const CallerAccount* caller) {
  {
    const MutexLock lock(mutex_);
    share_.GiveBack(caller, bytes);
    held_ -= bytes;
  }
  Grant();
  reads_.ServeWaiting();
}

std::uint64_t MemoryBudget::TakeForWorker(std::uint64_t bytes, const void* worker) {
  const MutexLock lock(mutex_);
  while (FitsNow({{}, bytes, nullptr, FairShare::kNoLimit}) != Fit::kYes) {
    TellShortage();
    if (worker_beyond_ == nullptr || worker_beyond_ == worker) {
      bytes = std::min(bytes, most_of_worker_ - bytes_of_worker_beyond_);
      TakeBeyond(bytes, worker);
      return bytes;
    }
    may_compute_.Wait(mutex_);
  }
  share_.Take(nullptr, bytes);
  held_ += bytes;
  return bytes;
}

bool MemoryBudget::TryTakeBeyond(std::uint64_t bytes, const void* worker) {
  const MutexLock lock(mutex_);
  if (worker_beyond_ != nullptr && worker_beyond_ != worker) return false;
  if (bytes > most_of_worker_ - bytes_of_worker_beyond_) return false;
  TakeBeyond(bytes, worker);
  return true;
}

void MemoryBudget::TakeBeyond(std::uint64_t bytes, const void* worker) {
  worker_beyond_ = worker;
  bytes_of_worker_beyond_ += bytes;
  share_.AddBeyond(bytes);
  share_.Take(nullptr, bytes);
  held_ += bytes;
}

bool MemoryBudget::IsBeyond(const void* worker) const {
  const MutexLock lock(mutex_);
  return worker_beyond_ == worker;
}

void MemoryBudget::GiveBackOfWorker(std::uint64_t bytes, const void* worker) {
  {
    const MutexLock lock(mutex_);
    if (worker_beyond_ == worker) {
      worker_beyond_ = nullptr;
      share_.RemoveBeyond(std::exchange(bytes_of_worker_beyond_, 0));
    }
  }
  GiveBack(bytes);
}

void MemoryBudget::Grant() {
  std::vector<std::pair<std::shared_ptr<Waiter>, std::uint64_t>> granted;
  {
    const MutexLock lock(mutex_);
    std::set<const CallerAccount*> waiting;  // Callers with an earlier claim that must wait.
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
        held_ += claim->bytes;
        granted.emplace_back(std::move(waiter), claim->bytes);
      }
      claim = claims_.erase(claim);
    }
  }
  may_compute_.NotifyAll();  // Memory may be free now, or a claim no longer blocks the workers.
  for (const auto& [waiter, bytes] : granted) waiter->Granted(bytes);
}

void MemoryBudget::TellShortage() const {
  if (tell_shortage_) tell_shortage_();
}

void MemoryBudget::OnShortage(std::function<void()> tell) {
  const MutexLock lock(mutex_);
  tell_shortage_ = std::move(tell);
}

std::uint64_t MemoryBudget::held() const {
  const MutexLock lock(mutex_);
  return held_;
}

std::uint64_t MemoryBudget::planned() const {
  const MutexLock lock(mutex_);
  return share_.held();
}

void MemoryBudget::Plan(std::uint64_t bytes, const CallerAccount* caller) {
  const MutexLock lock(mutex_);
  share_.Take(caller, bytes);
}

bool MemoryBudget::TryPlan(std::uint64_t bytes, const CallerAccount* caller) {
  const std::uint64_t most = QuotaOf(caller);
  const MutexLock lock(mutex_);
  const Fit fit = share_.Fits(caller, bytes, most);
  if (fit == Fit::kYes) share_.Take(caller, bytes);
  if (fit == Fit::kNoRoom) TellShortage();
  return fit == Fit::kYes;
}

void MemoryBudget::Unplan(std::uint64_t bytes, const CallerAccount* caller) {
  const MutexLock lock(mutex_);
  share_.GiveBack(caller, bytes);
  may_compute_.NotifyAll();
}

absl::Status MemoryBudget::CheckHeld(std::uint64_t bytes, const CallerAccount* caller) const {
  const std::uint64_t most = QuotaOf(caller);
  const MutexLock lock(mutex_);
  if (caller != nullptr && share_.held_by(caller) > most) return TooManyBytesOfCaller(bytes);
  if (share_.Fits(nullptr, 0) == Fit::kYes) return absl::OkStatus();
  return NoRoomInBudget("frame", bytes, share_.room());
}

void MemoryBudget::ChangeBeyond(std::uint64_t before, std::uint64_t after) {
  const MutexLock lock(mutex_);
  share_.RemoveBeyond(before);
  share_.AddBeyond(after);
  may_compute_.NotifyAll();
}

bool MemoryBudget::FitsWithout(std::uint64_t beyond, const CallerAccount* caller) const {
  const std::uint64_t most = QuotaOf(caller);
  const MutexLock lock(mutex_);
  return share_.FitsWithout(beyond, caller, most);
}

std::uint64_t MemoryBudget::PlannedBy(const CallerAccount* caller) const {
  const MutexLock lock(mutex_);
  return share_.held_by(caller);
}

}  // namespace partiemc::server
