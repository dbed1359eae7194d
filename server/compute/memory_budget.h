// Limits the memory that the requests and responses of all streams hold together.
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

/// The violation's reason if a call of ReconstructFrame does not fit into the budget
/// (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonMemoryBudget = "MEMORY_BUDGET";

/// RESOURCE_EXHAUSTED (MEMORY_BUDGET): `bytes` do not fit into the budget.
absl::Status NoRoomInBudget(std::string field, std::uint64_t bytes, std::uint64_t budget);

/// The caller's quota of bytes; FairShare::kNoLimit if it has none.
std::uint64_t QuotaOf(const CallerAccount* caller);

/// Limits of the memory that streams and one worker may hold beyond the budget, so that large
/// frames can be computed.
struct BeyondBudget {
  ReadTerms reads;
  /// Maximum bytes of the one worker that may compute beyond the budget.
  std::uint64_t worker_bytes = std::numeric_limits<std::uint64_t>::max();
};

/// Counts bytes against the budget, and queues claims (requests for bytes) that do not fit.
///
/// The budget counts held bytes, which exist, and planned bytes, which reads in progress may bring
/// (ReadPermits). The sum of both must fit. Callers share the budget (FairShare); a null `caller`
/// is limited by the budget only. If a claim exceeds its caller's share, it waits until that caller
/// holds less, and later claims of this caller wait behind it. All other claims are granted in
/// order. A claim never overtakes an earlier claim that does not fit into the budget, so a stream
/// of small frames cannot starve a stream of large frames.
///
/// Thread-safe. Only TakeForWorker blocks.
class MemoryBudget {
 public:
  class Waiter {
   public:
    virtual ~Waiter() = default;
    /// The waiter now holds `bytes`. The thread that freed memory calls this, without holding a
    /// lock.
    virtual void Granted(std::uint64_t bytes) = 0;
  };

  explicit MemoryBudget(std::uint64_t bytes, const BeyondBudget& beyond = {})
      : most_of_worker_(beyond.worker_bytes),
        bytes_(bytes),
        share_(bytes),
        reads_(*this, beyond.reads) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  /// Decides which streams may read.
  ReadPermits& reads() { return reads_; }

  /// Counts bytes that the caller holds already, even if they do not fit.
  void Take(std::uint64_t bytes, const CallerAccount* caller = nullptr) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Takes the bytes if they fit and no earlier claim waits. Returns kYes, or the reason why they
  /// were not taken.
  FairShare::Fit TryTake(std::uint64_t bytes, const CallerAccount* caller = nullptr)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Takes the bytes like TryTake. If they do not fit, queues a claim and calls `Granted` as soon
  /// as they do, provided that `waiter` still exists. The waiter keeps the caller's account alive.
  bool TakeOrWait(std::uint64_t bytes, const std::shared_ptr<Waiter>& waiter,
                  const CallerAccount* caller = nullptr) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Removes the claims of `waiter`. A call of `Granted` that another thread has already begun
  /// still arrives.
  void StopWaiting(const std::shared_ptr<Waiter>& waiter) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Gives back bytes and grants claims that then fit. Requires: the calling thread holds no lock.
  void GiveBack(std::uint64_t bytes, const CallerAccount* caller = nullptr)
      ABSL_LOCKS_EXCLUDED(mutex_);

  /// Takes bytes for a worker. Blocks until they fit into the budget, or until no other worker
  /// computes beyond the budget. In the second case the bytes are taken beyond the budget, at most
  /// BeyondBudget::worker_bytes. Returns the number of bytes taken.
  std::uint64_t TakeForWorker(std::uint64_t bytes, const void* worker) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Takes bytes for a worker beyond the budget. Returns false if another worker computes beyond
  /// the budget, or if this worker would exceed BeyondBudget::worker_bytes.
  bool TryTakeBeyond(std::uint64_t bytes, const void* worker) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Whether `worker` holds bytes beyond the budget.
  bool IsBeyond(const void* worker) const ABSL_LOCKS_EXCLUDED(mutex_);
  /// Gives back all `bytes` that a worker holds, both within the budget and beyond it.
  void GiveBackOfWorker(std::uint64_t bytes, const void* worker) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Sets the function that is called when a claim does not fit into the budget. It is not called
  /// if a claim only exceeds its caller's share. Empty: no call. `tell` must not call MemoryBudget.
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
    std::uint64_t most = FairShare::kNoLimit;  // The caller's quota when the claim was made.
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
  // Changes the bytes that are permitted beyond the budget: removes `before` and adds `after`.
  void ChangeBeyond(std::uint64_t before, std::uint64_t after) ABSL_LOCKS_EXCLUDED(mutex_);
  // Whether all held and planned bytes would still fit into the budget, and those of the caller
  // into its quota and share, if `beyond` fewer bytes were permitted beyond the budget.
  bool FitsWithout(std::uint64_t beyond, const CallerAccount* caller) const
      ABSL_LOCKS_EXCLUDED(mutex_);
  // Returns an error if all counted bytes, which include `bytes`, exceed the budget or the caller's
  // quota.
  absl::Status CheckHeld(std::uint64_t bytes, const CallerAccount* caller) const
      ABSL_LOCKS_EXCLUDED(mutex_);
  std::uint64_t PlannedBy(const CallerAccount* caller) const ABSL_LOCKS_EXCLUDED(mutex_);

  const std::uint64_t most_of_worker_, bytes_;

  mutable Mutex mutex_;
  CondVar may_compute_;
  // The worker that computes beyond the budget.
  const void* worker_beyond_ ABSL_GUARDED_BY(mutex_) = nullptr;
  // Its bytes beyond the budget.
  std::uint64_t bytes_of_worker_beyond_ ABSL_GUARDED_BY(mutex_) = 0;
  FairShare share_ ABSL_GUARDED_BY(mutex_);  // Held and planned bytes; may exceed the budget.
  std::uint64_t held_ ABSL_GUARDED_BY(mutex_) = 0;
  std::list<Claim> claims_ ABSL_GUARDED_BY(mutex_);
  std::function<void()> tell_shortage_ ABSL_GUARDED_BY(mutex_);

  ReadPermits reads_;  // Its mutex is locked before mutex_.
};

}  // namespace partiemc::server
