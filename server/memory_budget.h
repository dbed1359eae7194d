// How much memory the requests and answers of all streams may hold together.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string_view>

namespace partiemc::server {

/// The reason of RESOURCE_EXHAUSTED for a ReconstructFrame that the budget has no room for
/// (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonMemoryBudget = "MEMORY_BUDGET";

/// Counts bytes and lets those who want more of them wait their turn. What waits is served in the
/// order in which it came, and nobody takes room past it, so that a stream of small frames cannot
/// keep one of large frames out. Safe from any thread; no call blocks.
class MemoryBudget {
 public:
  class Waiter {
   public:
    virtual ~Waiter() = default;
    /// What was waited for is this waiter's own now. Called without a lock, by whoever made room.
    virtual void Granted(std::uint64_t bytes) = 0;
  };

  explicit MemoryBudget(std::uint64_t bytes) : bytes_(bytes) {}

  /// Takes what is held already, room or not.
  void Take(std::uint64_t bytes);
  /// Takes it if there is room and nobody waits.
  bool TryTake(std::uint64_t bytes);
  /// As TryTake; if that fails, `waiter` gets it when there is room, unless it has gone by then.
  bool TakeOrWait(std::uint64_t bytes, const std::shared_ptr<Waiter>& waiter);
  /// `waiter` does not wait any more. It may be granted what it waited for all the same, where that
  /// is happening now.
  void StopWaiting(const std::shared_ptr<Waiter>& waiter);
  /// To be called without a lock: others may be granted what they wait for.
  void GiveBack(std::uint64_t bytes);

  std::uint64_t held() const;
  std::uint64_t bytes() const { return bytes_; }

 private:
  struct Wish {
    std::weak_ptr<Waiter> waiter;
    std::uint64_t bytes = 0;
  };

  bool HasRoom(std::uint64_t bytes) const { return held_ <= bytes_ && bytes <= bytes_ - held_; }
  void Grant();

  const std::uint64_t bytes_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::uint64_t held_ = 0;    // May be more than bytes_.
  std::deque<Wish> wishes_;
};

}  // namespace partiemc::server
