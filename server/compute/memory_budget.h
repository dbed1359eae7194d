// Limits the memory that requests, responses and workers hold together.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "common/mutex.h"
#include "server/compute/fair_share.h"
#include "server/compute/read_permits.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// The violation's reason if the budget has no room for a unary request, a part of a frame or a
/// level of detail (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonMemoryBudget = "MEMORY_BUDGET";

/// RESOURCE_EXHAUSTED (MEMORY_BUDGET): `bytes` do not fit into a budget of `budget` bytes. `field`
/// becomes the field of the Violation.
absl::Status NoRoomInBudget(std::string field, std::uint64_t bytes, std::uint64_t budget);

/// The caller's quota of bytes; FairShare::kNoLimit if the caller is null or has no quota.
std::uint64_t QuotaOf(const CallerAccount* caller);

/// Limits of the memory that streams and one worker may hold beyond the budget. Without this
/// memory, a large frame could wait forever.
struct BeyondBudget {
  ReadTerms reads;
  /// Maximum bytes of the one worker that may compute beyond the budget.
  std::uint64_t worker_bytes = std::numeric_limits<std::uint64_t>::max();
};

/// Counts bytes against the budget, and queues claims (requests for bytes) that do not fit.
///
/// The budget counts held bytes, which exist, and planned bytes, which reads in progress may bring
/// (ReadPermits). The sum of both must fit. Callers share the budget (FairShare); a null `caller`
/// is limited by the budget only.
///
/// Order: a claim waits behind each earlier claim of the same caller. It also waits behind an
/// earlier claim for which the budget has no room (Fit::kNoRoom), so small claims cannot starve a
/// large one. It overtakes claims of other callers that only exceed their caller's share.
///
/// Thread-safe. Only TakeForWorker blocks.
class MemoryBudget {
 public:
  class Waiter {
   public:
    virtual ~Waiter() = default;
    /// The claim was granted: the waiter now holds `bytes`. Called without holding a lock.
    virtual void Granted(std::uint64_t bytes) = 0;
  };

  explicit MemoryBudget(std::uint64_t bytes, const BeyondBudget& beyond = {})
      : most_of_worker_(beyond.worker_bytes),
        bytes_(bytes),
        share_(bytes),
        reads_(*this, beyond.reads) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  ReadPermits& reads() { return reads_; }

  /// Counts bytes that `caller` holds already, even if they do not fit.
  void Take(std::uint64_t bytes, const CallerAccount* caller = nullptr) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Takes the bytes if they fit and need not wait behind a claim (class comment, "Order"). Returns
  /// kYes, or the reason why they were not taken.
  FairShare::Fit TryTake(std::uint64_t bytes, const CallerAccount* caller = nullptr)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Takes the bytes and returns true if TryTake would. Otherwise queues a claim and returns false;
  /// `Granted` is called when the claim is granted, unless `waiter` no longer exists. The waiter
  /// keeps the caller's account alive.
  bool TakeOrWait(std::uint64_t bytes, const std::shared_ptr<Waiter>& waiter,
                  const CallerAccount* caller = nullptr) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Removes the claims of `waiter`, and grants claims that waited behind them. If another thread
  /// has already granted a claim of `waiter`, `Granted` may still be called after this returns.
  void StopWaiting(const std::shared_ptr<Waiter>& waiter) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Gives back bytes. Grants claims and permits reads that then fit. Requires: the calling thread
  /// holds no lock.
  void GiveBack(std::uint64_t bytes, const CallerAccount* caller = nullptr)
      ABSL_LOCKS_EXCLUDED(mutex_);

  /// Takes bytes for a worker. Blocks until they fit into the budget, or until no other worker
  /// computes beyond the budget. In the second case takes them beyond the budget, where the worker
  /// may hold at most BeyondBudget::worker_bytes, so it may take fewer. Returns the number of bytes
  /// taken.
  std::uint64_t TakeForWorker(std::uint64_t bytes, const void* worker) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Takes bytes for a worker beyond the budget. Returns false if another worker computes beyond
  /// the budget, or if this worker would exceed BeyondBudget::worker_bytes.
  bool TryTakeBeyond(std::uint64_t bytes, const void* worker) ABSL_LOCKS_EXCLUDED(mutex_);
  bool IsBeyond(const void* worker) const ABSL_LOCKS_EXCLUDED(mutex_);
  /// Gives back all `bytes` that a worker holds, both within the budget and beyond it.
  void GiveBackOfWorker(std::uint64_t bytes, const void* worker) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Sets the function that is called when the budget has no room for bytes or for a read. Bytes
  /// that only exceed their caller's share cause no call. The function is called with the lock
  /// held, so it must not call MemoryBudget. Empty: no call.
  void OnShortage(std::function<void()> tell) ABSL_LOCKS_EXCLUDED(mutex_);

  std::uint64_t held() const ABSL_LOCKS_EXCLUDED(mutex_);
  /// Held and planned bytes.
  std::uint64_t planned() const ABSL_LOCKS_EXCLUDED(mutex_);
  std::uint64_t bytes() const { return bytes_; }

 private:
  friend class ReadPermits;
  struct Claim {
    std::weak_ptr<Waiter> waiter;
    std::uint64_t bytes = 0;
    const CallerAccount* caller = nullptr;
    std::uint64_t most = FairShare::kNoLimit;  // The caller's quota when it made the claim.
  };

  FairShare::Fit Fits(const Claim& claim) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return share_.Fits(claim.caller, claim.bytes, claim.most);
  }
  FairShare::Fit FitsNow(const Claim& claim) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void TellShortage() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void TakeBeyond(std::uint64_t bytes, const void* worker) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Grant() ABSL_LOCKS_EXCLUDED(mutex_);
  // Called by ReadPermits, which holds its lock:
  void Plan(std::uint64_t bytes, const CallerAccount* caller) ABSL_LOCKS_EXCLUDED(mutex_);
  bool TryPlan(std::uint64_t bytes, const CallerAccount* caller) ABSL_LOCKS_EXCLUDED(mutex_);
  void Unplan(std::uint64_t bytes, const CallerAccount* caller) ABSL_LOCKS_EXCLUDED(mutex_);
  // Replaces `before` of the bytes that are permitted beyond the budget by `after`.
  void ChangeBeyond(std::uint64_t before, std::uint64_t after) ABSL_LOCKS_EXCLUDED(mutex_);
  // Whether the budget, and the caller's quota and share, would suffice for all held and planned
  // bytes if `beyond` fewer bytes were permitted beyond the budget.
  bool FitsWithout(std::uint64_t beyond, const CallerAccount* caller) const
      ABSL_LOCKS_EXCLUDED(mutex_);
  // Returns an error if the held and planned bytes of the caller exceed its quota, or if the held
  // and planned bytes of all callers exceed the budget. `bytes` are already counted; only the
  // error's text uses them.
  absl::Status CheckHeld(std::uint64_t bytes, const CallerAccount* caller) const
      ABSL_LOCKS_EXCLUDED(mutex_);
  std::uint64_t PlannedBy(const CallerAccount* caller) const ABSL_LOCKS_EXCLUDED(mutex_);

  const std::uint64_t most_of_worker_, bytes_;

  mutable Mutex mutex_;
  CondVar may_compute_;
  const void* worker_beyond_ ABSL_GUARDED_BY(mutex_) = nullptr;
  std::uint64_t bytes_of_worker_beyond_ ABSL_GUARDED_BY(mutex_) = 0;
  FairShare share_ ABSL_GUARDED_BY(mutex_);  // Held and planned bytes; may exceed the budget.
  std::uint64_t held_ ABSL_GUARDED_BY(mutex_) = 0;
  std::list<Claim> claims_ ABSL_GUARDED_BY(mutex_);
  std::function<void()> tell_shortage_ ABSL_GUARDED_BY(mutex_);

  ReadPermits reads_;  // Its mutex is locked before mutex_.
};

}  // namespace partiemc::server
