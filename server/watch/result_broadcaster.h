// The fan-out of one stream: its producer's results go in, its watchers get them.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "server/watch/result_history.h"
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
    /// The newest frame is kept for a watcher that comes later, although nobody watches, if it is
    /// no larger; whether there is a history or not.
    std::size_t kept_bytes = std::size_t{1} << 20;
  };

  /// `dispatcher` lives longer.
  ResultBroadcaster(WatchDispatcher& dispatcher, const Limits& limits);

  /// From now on keeps frames that watchers can go back to, as far as `room`, which lives longer,
  /// lets it. Where the stream goes on from `former`, the frames before `next_sequence` that are
  /// held there are the first; those after it will be made again. To be called before Publish and
  /// Join, once.
  void BeginHistory(HistoryRoom& room, ResultBroadcaster* former, std::uint64_t next_sequence);
  /// Others have come: their histories want a share of the room. Waits for nothing.
  void ShareRoom() { dispatcher_.Wake(*this); }

  /// A result of the stream, the answer of the frame with this sequence number, which is larger
  /// than that of the one before. Wait-free: a lock is taken only if nobody has it. True if
  /// somebody watches: then Announce is to follow.
  [[nodiscard]] bool Publish(std::shared_ptr<const WatchFrame> frame, std::uint64_t sequence);
  /// The same of a result that another server has numbered, and announced at once; numbers rise,
  /// and those left out never come.
  void PublishNumbered(Published published);
  /// The results before those that are held here can be asked for from this sequence number on, of
  /// the server that made them. 0: none can.
  void SetOldestElsewhere(std::uint64_t sequence) { oldest_elsewhere_ = sequence; }
  /// Has watchers served with what was published. From any thread; wakes the dispatcher's, without
  /// waiting for it. Apart from Publish, so that a producer's own answer is on its way before the
  /// dispatcher writes to watchers: their writes take the same locks of gRPC.
  void Announce();
  /// The stream has ended. Watchers get what was published, then this.
  void End(WatchEnd end);

  /// Where a watcher begins.
  struct Joined {
    HeldFrames held;
    Published first;                ///< If there is one, to be shown at once.
    std::uint64_t next_held = 0;    ///< Else from this frame on, by Held; 0: from what comes now.
    std::uint64_t last_number = 0;  ///< Of what had been published by then.
  };
  /// From the frame of sequence number `from` on, or from the oldest that is held; without it, from
  /// the newest on. What is published after this call is offered, none of it is left out.
  Joined Join(std::shared_ptr<WatchStateMachine> watcher, std::optional<std::uint64_t> from);
  void Leave(const WatchStateMachine& watcher);

  /// The first frame of at least this number in the history, offered or not; none: all are older.
  Published Held(std::uint64_t number);
  /// Likewise of at least this sequence number.
  Published HeldFrom(std::uint64_t sequence);
  /// The newest one, if it is held.
  Published Newest();
  /// The number of the last result.
  std::uint64_t LastNumber();
  /// The oldest sequence number that can be asked for; 0: none.
  std::uint64_t oldest_sequence() const {
    const std::uint64_t elsewhere = oldest_elsewhere_, here = oldest_sequence_;
    return elsewhere != 0 && (here == 0 || elsewhere < here) ? elsewhere : here;
  }
  /// The oldest one that is held here; 0: none.
  std::uint64_t oldest_here() const { return oldest_sequence_; }

  std::uint32_t watcher_count() const { return watcher_count_; }
  /// How often the producer's thread had to sleep to publish or to announce, as the system counts
  /// it.
  std::uint64_t producer_waits() const { return producer_waits_; }

 private:
  void Serve() override;
  std::vector<Published> HandOver();
  void DropHistoryOf(const std::vector<std::shared_ptr<WatchStateMachine>>& watchers);
  // With the lock held:
  void Collect();
  void NoteOldest();
  template <typename Action>
  void CountWaits(Action action);

  WatchDispatcher& dispatcher_;
  const Limits limits_;
  ResultMailbox mailbox_;
  std::uint64_t published_ = 0;  // Of the producer's thread.
  std::atomic<std::uint64_t> producer_waits_ = 0;
  std::atomic<std::uint32_t> watcher_count_ = 0;
  std::atomic<std::uint64_t> oldest_sequence_ = 0, oldest_elsewhere_ = 0;

  std::mutex mutex_;  // Guards everything below. Publish never waits for it.
  std::vector<std::shared_ptr<WatchStateMachine>> watchers_;
  std::uint64_t collected_ = 0;  // The number of the last frame that was taken from the mailbox.
  std::vector<Published> news_;  // Of those, what has not been offered yet.
  std::optional<ResultHistory> history_;
  Published newest_;  // If it is in the history, or small, or somebody watches.
  std::optional<WatchEnd> end_;
};

}  // namespace partiemc::server
