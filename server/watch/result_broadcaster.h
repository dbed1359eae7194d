// The fan-out of one stream: its producer's results go in, its watchers get them.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "server/watch/result_mailbox.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

/// Publish comes from one thread at a time; it and Announce never wait, whatever watchers do.
/// Everything else comes from any thread. Held by shared_ptr only.
class ResultBroadcaster final : public Dispatched {
 public:
  struct Limits {
    /// Of frames that the dispatcher has not come to yet.
    std::size_t mailbox_bytes = std::size_t{16} << 20;
    /// A frame of at most this size is kept for a watcher that comes later, although nobody
    /// watches.
    std::size_t kept_bytes = std::size_t{1} << 20;
  };

  /// `dispatcher` lives longer.
  ResultBroadcaster(WatchDispatcher& dispatcher, const Limits& limits);

  /// A result of the stream. Wait-free. True if somebody watches: then Announce is to follow.
  [[nodiscard]] bool Publish(std::shared_ptr<const WatchFrame> frame);
  /// Has watchers served with what was published. From any thread; wakes the dispatcher's, without
  /// waiting for it. Apart from Publish, so that a producer's own answer is on its way before the
  /// dispatcher writes to watchers: their writes take the same locks of gRPC.
  void Announce();
  /// The stream has ended. Watchers get what was published, then this.
  void End(WatchEnd end);

  /// From the newest frame on, which it gets at once if there is one; of what is published after
  /// this call it misses nothing.
  void Join(std::shared_ptr<WatchStateMachine> watcher);
  void Leave(const WatchStateMachine& watcher);

  std::uint32_t watcher_count() const { return watcher_count_; }
  /// How often the producer's thread had to sleep to publish or to announce, as the system counts
  /// it.
  std::uint64_t producer_waits() const { return producer_waits_; }

 private:
  struct Entry {
    std::shared_ptr<WatchStateMachine> machine;
    Published first = {};  // The newest frame when it joined; until it has been served.
  };

  void Serve() override;
  void TakeNews();  // With the lock held.
  template <typename Action>
  void CountWaits(Action action);

  WatchDispatcher& dispatcher_;
  const Limits limits_;
  ResultMailbox mailbox_;
  std::uint64_t published_ = 0;  // Of the producer's thread.
  std::atomic<std::uint64_t> producer_waits_ = 0;
  std::atomic<std::uint32_t> watcher_count_ = 0;

  std::mutex mutex_;  // Guards everything below. Publish never takes it.
  std::vector<Entry> watchers_;
  std::vector<Published> news_;  // Taken from the mailbox, not yet offered.
  Published newest_;             // While somebody watches.
  std::optional<WatchEnd> end_;
};

}  // namespace partiemc::server
