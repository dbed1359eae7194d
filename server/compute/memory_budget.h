// How much memory the requests and answers of all streams may hold together.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "server/compute/fair_share.h"
#include "server/compute/read_permits.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// The reason of RESOURCE_EXHAUSTED for a ReconstructFrame that the budget has no room for
/// (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonMemoryBudget = "MEMORY_BUDGET";

/// RESOURCE_EXHAUSTED (MEMORY_BUDGET) for bytes that the budget has no room for.
absl::Status NoRoomInBudget(std::string field, std::uint64_t bytes, std::uint64_t budget);

/// What may be held although the budget has no room for it.
struct BeyondBudget {
  ReadTerms reads;
  /// Bytes that one worker at a time computes with.
  std::uint64_t worker_bytes = std::numeric_limits<std::uint64_t>::max();
};

/// Counts bytes and lets those who want more of them wait their turn. Callers share it (FairShare):
/// who wants more than the share of its caller waits for that, and only others of this caller wait
/// behind. All else is served in the order in which it came, and nobody takes room past it, so that
/// a stream of small frames cannot keep one of large frames out. Where `caller` is null, only the
/// room counts. Beside the bytes that are held it counts planned ones, which reads that go on can
/// bring (ReadPermits): both together have to fit. Safe from any thread; no call blocks for long.
class MemoryBudget {
 public:
  class Waiter {
   public:
    virtual ~Waiter() = default;
    /// What was waited for is this waiter's own now. Called without a lock, by whoever made room.
    virtual void Granted(std::uint64_t bytes) = 0;
  };

  explicit MemoryBudget(std::uint64_t bytes, const BeyondBudget& beyond = {})
      : most_of_worker_(beyond.worker_bytes), share_(bytes), reads_(*this, beyond.reads) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  /// Which streams may be read from.
  ReadPermits& reads() { return reads_; }

  /// Takes what is held already, room or not.
  void Take(std::uint64_t bytes, const CallerAccount* caller = nullptr);
  /// Takes it if there is room and nobody waits for it who came before. Tells whether, or why not.
  FairShare::Fit TryTake(std::uint64_t bytes, const CallerAccount* caller = nullptr);
  /// As TryTake; if that fails, `waiter` gets it when there is room, unless it has gone by then.
  /// The waiter keeps the caller's account alive.
  bool TakeOrWait(std::uint64_t bytes, const std::shared_ptr<Waiter>& waiter,
                  const CallerAccount* caller = nullptr);
  /// `waiter` does not wait any more. It may be granted what it waited for all the same, where that
  /// is happening now.
  void StopWaiting(const std::shared_ptr<Waiter>& waiter);
  /// To be called without a lock: others may be granted what they wait for.
  void GiveBack(std::uint64_t bytes, const CallerAccount* caller = nullptr);

  /// Takes bytes for a worker. If the budget has no room for them, waits until there is room or no
  /// other worker computes beyond the budget, and takes them beyond it: no more than
  /// BeyondBudget::worker_bytes. Returns what was taken.
  std::uint64_t TakeForWorker(std::uint64_t bytes, const void* worker);
  /// Takes bytes beyond the budget, if no other worker computes there, and the worker has no more
  /// than BeyondBudget::worker_bytes there.
  bool TryTakeBeyond(std::uint64_t bytes, const void* worker);
  /// Whether the worker computes beyond the budget.
  bool IsBeyond(const void* worker) const;
  /// Gives back all that a worker holds.
  void GiveBackOfWorker(std::uint64_t bytes, const void* worker);

  /// From now on `tell` is called whenever somebody is refused or has to wait for want of room, not
  /// of its caller's share; empty: nobody is told. It must not call this.
  void OnShortage(std::function<void()> tell);

  std::uint64_t held() const;
  /// With what is held.
  std::uint64_t planned() const;
  std::uint64_t bytes() const { return share_.room(); }

 private:
  friend class ReadPermits;
  struct Claim {
    std::weak_ptr<Waiter> waiter;
    std::uint64_t bytes = 0;
    const CallerAccount* caller = nullptr;
    std::uint64_t most = FairShare::kNoLimit;  // Of its caller, when it came.
  };

  // With the lock held:
  FairShare::Fit Fits(const Claim& claim) const {
    return share_.Fits(claim.caller, claim.bytes, claim.most);
  }
  FairShare::Fit FitsNow(const Claim& claim) const;
  void TellShortage() const;
  void TakeBeyond(std::uint64_t bytes, const void* worker);
  // Without:
  void Grant();
  // Of ReadPermits, with its lock held:
  void Plan(std::uint64_t bytes, const CallerAccount* caller);
  bool TryPlan(std::uint64_t bytes, const CallerAccount* caller);
  void Unplan(std::uint64_t bytes, const CallerAccount* caller);
  // Permits `after` bytes beyond the room instead of `before`.
  void ChangeBeyond(std::uint64_t before, std::uint64_t after);
  // Whether what the caller holds fits with `beyond` bytes less beyond the room.
  bool FitsWithout(std::uint64_t beyond, const CallerAccount* caller) const;
  // Whether `bytes` that are counted already fit into the budget and its caller's quota.
  absl::Status CheckHeld(std::uint64_t bytes, const CallerAccount* caller) const;
  std::uint64_t PlannedBy(const CallerAccount* caller) const;

  const std::uint64_t most_of_worker_;

  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable may_compute_;
  const void* worker_beyond_ = nullptr;       // The worker that computes beyond the budget.
  std::uint64_t bytes_of_worker_beyond_ = 0;  // There.
  FairShare share_;         // Of what is held or planned: may be more than its room.
  std::uint64_t held_ = 0;  // Of that.
  std::list<Claim> claims_;
  std::function<void()> tell_shortage_;

  ReadPermits reads_;  // Has a lock of its own, which is taken first.
};

}  // namespace partiemc::server
