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

/// Publishes the results of a stream and keeps its watchers. Publish and Announce never wait for
/// watchers. Publish is called by one thread at a time; all other functions are thread-safe. Held
/// by shared_ptr.
class ResultBroadcaster final : public Dispatched, public HistoryOwner {
 public:
  struct Limits {
    /// Maximum bytes of frames that the dispatcher has not taken yet. If a new frame would exceed
    /// the limit, these frames are dropped; the new frame is kept, whatever its size.
    std::size_t mailbox_bytes = std::size_t{16} << 20;
    /// If there are no watchers and no history, the newest frame is kept for later watchers if it
    /// is at most this large.
    std::size_t kept_bytes = std::size_t{1} << 20;
  };

  /// Requires: `dispatcher` outlives this.
  ResultBroadcaster(WatchDispatcher& dispatcher, const Limits& limits);

  /// Starts a history within the limits of `room`. If the stream resumes the stream of `former`,
  /// the history takes over the former frames before `next_sequence` with their result numbers;
  /// later frames will be computed again. Returns frames that are no longer needed; the caller
  /// frees them without its locks, because they may be large. Requires: called once, before Publish
  /// and Join; `room` outlives this.
  std::vector<Published> BeginHistory(HistoryRoom& room, ResultBroadcaster* former,
                                      std::uint64_t next_sequence) ABSL_LOCKS_EXCLUDED(mutex_);
  void ShareRoom() override { dispatcher_.Wake(*this); }
  /// Keeps the history after the end of the stream, also without a watcher that reads it, until
  /// ReleaseHistory. Calls nest. A stream that resumes this one takes the history nevertheless.
  void HoldHistory() ABSL_LOCKS_EXCLUDED(mutex_);
  void ReleaseHistory() ABSL_LOCKS_EXCLUDED(mutex_);

  /// Publishes the result of the frame `sequence`. Wait-free: the result stays in the mailbox until
  /// a thread that holds the lock collects it. Returns whether there are watchers. If so, the
  /// caller must call Announce. Requires: `sequence` increases from call to call.
  [[nodiscard]] bool Publish(std::shared_ptr<const WatchFrame> frame, std::uint64_t sequence)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Publishes and announces a result of a stream that another server owns. `published` has the
  /// result number of that server. Requires: the numbers increase from call to call. Some may be
  /// missing, because the bus may lose results.
  void PublishNumbered(Published published);
  /// Sets the oldest sequence number in the history of the server that owns the stream. 0: it has
  /// no history.
  void SetOldestElsewhere(std::uint64_t sequence) { oldest_elsewhere_ = sequence; }
  /// Wakes the dispatcher, which delivers the published results. Does not block; thread-safe. A
  /// separate function, so that the producer's response can be sent before this call: writes to
  /// watchers take the same locks of gRPC as the response.
  void Announce();
  /// Ends the stream. Watchers receive the results published so far, then `end`.
  void End(WatchEnd end) ABSL_LOCKS_EXCLUDED(mutex_);

  /// The start of a watch.
  struct Joined {
    HeldFrames held;
    Published first;  ///< The newest result, to deliver at once; may be empty.
    std::uint64_t next_held =
        0;  ///< First number to read with Held, if `first` is empty; 0: live results only.
    std::uint64_t last_number = 0;  ///< Number of the last published result.
  };
  /// Adds a watcher. It starts with the frame of sequence number `from`, or else with the oldest
  /// available frame after it. Without `from`, it starts with the newest frame. If all are older
  /// than `from`, it starts with the next published result. All results published after this call
  /// are offered to the watcher.
  Joined Join(std::shared_ptr<WatchStateMachine> watcher, std::optional<std::uint64_t> from)
      ABSL_LOCKS_EXCLUDED(mutex_);
  void Leave(const WatchStateMachine& watcher) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Returns the first frame of the history whose result number is at least `number`; empty if all
  /// are older.
  Published Held(std::uint64_t number) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Returns the first frame of the history whose sequence number is at least `sequence`. If the
  /// history has none, returns the newest frame if its number suffices, otherwise an empty result.
  Published HeldFrom(std::uint64_t sequence) ABSL_LOCKS_EXCLUDED(mutex_);
  /// The newest frame, if it is kept.
  Published Newest() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Result number of the last published result.
  std::uint64_t LastNumber() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Sequence number of the last published result; 0: none.
  std::uint64_t last_sequence() const { return last_sequence_; }
  /// The oldest sequence number that watchers can request, here or at the server that owns the
  /// stream; 0: none.
  std::uint64_t oldest_sequence() const {
    const std::uint64_t elsewhere = oldest_elsewhere_, here = oldest_sequence_;
    return elsewhere != 0 && (here == 0 || elsewhere < here) ? elsewhere : here;
  }
  /// The oldest sequence number in the history of this server; 0: there is none.
  std::uint64_t oldest_here() const { return oldest_sequence_; }

  std::uint32_t watcher_count() const { return watcher_count_; }
  /// Number of calls of Publish and Announce, with watchers, in which the producer's thread waited.
  std::uint64_t producer_waits() const { return producer_waits_; }

 private:
  void Serve() override ABSL_LOCKS_EXCLUDED(mutex_);
  // Returns the history for the stream that resumes this one; null if there is none. Moves it, or
  // copies the frames before `next_sequence` if present watchers may still read it. Adds frames
  // that are no longer needed to `dropped`.
  std::unique_ptr<ResultHistory> HandOver(std::uint64_t next_sequence,
                                          std::vector<Published>& dropped)
      ABSL_LOCKS_EXCLUDED(mutex_);
  // As Publish.
  [[nodiscard]] bool Post(Published published) ABSL_LOCKS_EXCLUDED(mutex_);
  void DropHistoryUnlessRead(const std::vector<std::shared_ptr<WatchStateMachine>>& watchers)
      ABSL_LOCKS_EXCLUDED(mutex_);
  // Takes the frames of the mailbox. Returns the frames that were dropped from news_. The caller
  // frees them without the lock, because they may be large.
  [[nodiscard]] std::vector<Published> Collect() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Adds a frame to news_. Moves the older ones to `dropped` if they exceed `mailbox_bytes`
  // together with it.
  void AddNews(const Published& published, std::vector<Published>& dropped)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::vector<Published> TakeNews() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void NoteOldest() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  template <typename Action>
  void CountWaits(Action action);

  WatchDispatcher& dispatcher_;
  const Limits limits_;
  ResultMailbox mailbox_;
  std::uint64_t published_ = 0;  // Owned by the producer's thread.
  std::atomic<std::uint64_t> producer_waits_ = 0;
  std::atomic<std::uint32_t> watcher_count_ = 0;
  std::atomic<std::uint64_t> last_sequence_ = 0;
  std::atomic<std::uint64_t> oldest_sequence_ = 0, oldest_elsewhere_ = 0;

  Mutex mutex_;  // Publish never waits for it.
  std::vector<std::shared_ptr<WatchStateMachine>> watchers_ ABSL_GUARDED_BY(mutex_);
  // Result number of the last frame taken from the mailbox.
  std::uint64_t collected_ ABSL_GUARDED_BY(mutex_) = 0;
  // Frames that were taken from the mailbox and have not been offered to watchers yet.
  std::vector<Published> news_ ABSL_GUARDED_BY(mutex_);
  std::size_t news_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::unique_ptr<ResultHistory> history_ ABSL_GUARDED_BY(mutex_);
  int history_holds_ ABSL_GUARDED_BY(mutex_) = 0;  // HoldHistory without ReleaseHistory.
  Published newest_ ABSL_GUARDED_BY(mutex_);  // Kept if it is in the history, small, or watched.
  std::optional<WatchEnd> end_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
