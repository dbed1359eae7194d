// How much memory the requests and answers of all streams may hold together.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string_view>

#include "server/compute/fair_share.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// The reason of RESOURCE_EXHAUSTED for a ReconstructFrame that the budget has no room for
/// (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonMemoryBudget = "MEMORY_BUDGET";

/// Counts bytes and lets those who want more of them wait their turn. Callers share it (FairShare):
/// who wants more than the share of its caller waits for that, and only others of this caller wait
/// behind. All else is served in the order in which it came, and nobody takes room past it, so that
/// a stream of small frames cannot keep one of large frames out. Where `caller` is null, only the
/// room counts. Safe from any thread; no call blocks for long.
class MemoryBudget {
 public:
  class Waiter {
   public:
    virtual ~Waiter() = default;
    /// What was waited for is this waiter's own now. Called without a lock, by whoever made room.
    virtual void Granted(std::uint64_t bytes) = 0;
  };

  explicit MemoryBudget(std::uint64_t bytes) : share_(bytes) {}

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

  /// From now on `tell` is called whenever somebody is refused or has to wait for want of room, not
  /// of its caller's share; empty: nobody is told. It must not call this.
  void OnShortage(std::function<void()> tell);

  std::uint64_t held() const;
  std::uint64_t bytes() const { return share_.room(); }

 private:
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
  // Without:
  void Grant();

  mutable std::mutex mutex_;  // Guards everything below.
  FairShare share_;           // More than its room may be held.
  std::list<Claim> claims_;
  std::function<void()> tell_shortage_;
};

}  // namespace partiemc::server
