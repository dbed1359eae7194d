// Delivers the results of one stream to its watchers.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/mutex.h"
#include "server/watch/result_history.h"
#include "server/watch/result_mailbox.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

/// Publish and Announce never wait for watchers. Publish is called by one thread at a time; all
/// other functions are thread-safe. Held by shared_ptr.
class ResultBroadcaster final : public Dispatched {
 public:
  struct Limits {
    /// Most bytes of frames that the dispatcher has not processed.
    std::size_t mailbox_bytes = std::size_t{16} << 20;
    /// Without watchers and history, the newest frame is kept for later watchers up to this size.
    std::size_t kept_bytes = std::size_t{1} << 20;
  };

  /// Requires: `dispatcher` outlives this.
  ResultBroadcaster(WatchDispatcher& dispatcher, const Limits& limits);

  /// Starts a history within the limits of `room`. If the stream resumes from `former`, the history
  /// takes its frames before `next_sequence`; later ones are computed again. Requires: one call,
  /// before Publish and Join; `room` outlives this.
  void BeginHistory(HistoryRoom& room, ResultBroadcaster* former, std::uint64_t next_sequence)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Shrinks the history after other histories have started. Does not block.
  void ShareRoom() { dispatcher_.Wake(*this); }

  /// Publishes the result of the frame `sequence`. Wait-free: takes a lock only if it is free.
  /// Returns whether there are watchers; then the caller must call Announce. Requires: `sequence`
  /// increases.
  [[nodiscard]] bool Publish(std::shared_ptr<const WatchFrame> frame, std::uint64_t sequence)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Publishes and announces a result with the number of another server. Requires: numbers
  /// increase; skipped numbers never follow.
  void PublishNumbered(Published published);
  /// Sets the oldest sequence number in the history of the server that owns the stream. 0: none.
  void SetOldestElsewhere(std::uint64_t sequence) { oldest_elsewhere_ = sequence; }
  /// Wakes the dispatcher to deliver published results. Does not block; thread-safe. Separate from
  /// Publish, so that the producer's response is sent before the writes to watchers, which take the
  /// same locks of gRPC.
  void Announce();
  /// Ends the stream. Watchers receive the published results, then `end`.
  void End(WatchEnd end) ABSL_LOCKS_EXCLUDED(mutex_);

  /// The start of a watch.
  struct Joined {
    HeldFrames held;
    Published first;  ///< The newest result, to deliver at once; may be empty.
    std::uint64_t next_held =
        0;  ///< Otherwise the first number to read with Held; 0: live results only.
    std::uint64_t last_number = 0;  ///< Number of the last published result.
  };
  /// Adds a watcher that starts at sequence number `from` or the oldest frame after it; without
  /// `from` at the newest frame. All results published after this call are offered to it.
  Joined Join(std::shared_ptr<WatchStateMachine> watcher, std::optional<std::uint64_t> from)
      ABSL_LOCKS_EXCLUDED(mutex_);
  void Leave(const WatchStateMachine& watcher) ABSL_LOCKS_EXCLUDED(mutex_);

  /// The first frame of the history with at least this number; empty if all are older.
  Published Held(std::uint64_t number) ABSL_LOCKS_EXCLUDED(mutex_);
  /// The first frame of the history with at least this sequence number; empty if all are older.
  Published HeldFrom(std::uint64_t sequence) ABSL_LOCKS_EXCLUDED(mutex_);
  /// The newest frame, if it is kept.
  Published Newest() ABSL_LOCKS_EXCLUDED(mutex_);
  /// The number of the last result.
  std::uint64_t LastNumber() ABSL_LOCKS_EXCLUDED(mutex_);
  /// The oldest sequence number that watchers can request; 0: none.
  std::uint64_t oldest_sequence() const {
    const std::uint64_t elsewhere = oldest_elsewhere_, here = oldest_sequence_;
    return elsewhere != 0 && (here == 0 || elsewhere < here) ? elsewhere : here;
  }
  /// The oldest sequence number in the history of this server; 0: none.
  std::uint64_t oldest_here() const { return oldest_sequence_; }

  std::uint32_t watcher_count() const { return watcher_count_; }
  /// Number of voluntary context switches of the producer's thread in Publish and Announce.
  std::uint64_t producer_waits() const { return producer_waits_; }

 private:
  void Serve() override ABSL_LOCKS_EXCLUDED(mutex_);
  std::vector<Published> HandOver() ABSL_LOCKS_EXCLUDED(mutex_);
  void DropHistoryOf(const std::vector<std::shared_ptr<WatchStateMachine>>& watchers)
      ABSL_LOCKS_EXCLUDED(mutex_);
  void Collect() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void NoteOldest() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  template <typename Action>
  void CountWaits(Action action);

  WatchDispatcher& dispatcher_;
  const Limits limits_;
  ResultMailbox mailbox_;
  std::uint64_t published_ = 0;  // Owned by the producer's thread.
  std::atomic<std::uint64_t> producer_waits_ = 0;
  std::atomic<std::uint32_t> watcher_count_ = 0;
  std::atomic<std::uint64_t> oldest_sequence_ = 0, oldest_elsewhere_ = 0;

  Mutex mutex_;  // Publish never waits for it.
  std::vector<std::shared_ptr<WatchStateMachine>> watchers_ ABSL_GUARDED_BY(mutex_);
  // Number of the last frame taken from the mailbox.
  std::uint64_t collected_ ABSL_GUARDED_BY(mutex_) = 0;
  // Frames taken from the mailbox and not offered yet.
  std::vector<Published> news_ ABSL_GUARDED_BY(mutex_);
  std::optional<ResultHistory> history_ ABSL_GUARDED_BY(mutex_);
  Published newest_ ABSL_GUARDED_BY(mutex_);  // Kept if it is in the history, small, or watched.
  std::optional<WatchEnd> end_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
