// The flow of results to one watcher: credits, drops, ends. Independent of messages and transport.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/watch/result_history.h"
#include "server/watch/result_mailbox.h"
#include "server/watch/watch_end.h"

namespace partiemc::server {

class ResultBroadcaster;

enum class WatchMode { kLatest, kEvery };

/// The request of a watcher.
struct WatchTerms {
  std::shared_ptr<ResultBroadcaster> broadcaster;  ///< The broadcaster of the stream.
  WatchMode mode = WatchMode::kLatest;
  std::uint64_t credit = 1;
  /// Start with the history from this sequence number; absent: with the newest frame.
  std::optional<std::uint64_t> from_sequence = {};
  /// Keep the history after the end of the stream, as long as the broadcaster exists.
  bool keeps_history = false;
};

/// A parsed request.
struct WatchRequest {
  enum class Kind { kMalformed, kEmpty, kOpen, kCredit };
  Kind kind = Kind::kMalformed;
  std::uint64_t credit = 0;
};

/// The transport of a watch. WatchStateMachine has at most one read and one write in progress and
/// never calls the transport with a lock held.
class WatchTransport {
 public:
  virtual ~WatchTransport() = default;

  /// Starts to read the next request; completes by WatchStateMachine::ReadDone or ReadEnded.
  virtual void StartRead() = 0;
  /// Starts to look up the stream of the `open` just read and prepares the message of WriteOpened;
  /// completes by WatchStateMachine::Opened, from within or later.
  virtual void StartOpen() = 0;

  /// Each starts a write; completes by WatchStateMachine::WriteDone.
  virtual void WriteOpened(const HeldFrames& held) = 0;
  /// `oldest_sequence`: the oldest frame that can be requested now.
  virtual void WriteFrame(const Published& published, std::uint64_t dropped,
                          std::uint64_t oldest_sequence) = 0;
  virtual void WriteEnded(const WatchEnd& end, std::uint64_t dropped) = 0;

  /// Makes the pending read and write fail soon.
  virtual void Cut() = 0;
  /// The last call to the transport; only a read may still be in progress.
  virtual void Finish(const absl::Status& status) = 0;
};

/// Counts from the first offered frame.
struct WatchCounts {
  std::uint64_t frames = 0;         ///< Passed to the transport.
  std::uint64_t dropped = 0;        ///< Never sent.
  std::size_t most_held_bytes = 0;  ///< Largest number of pending bytes.
};

/// The state machine of one watcher:
///
///   opening --open--> watching --stream ends, fell behind, drain--> ending ----> finished
///      |                 |                                            |             ^
///      |                 +------------ cancelled, write failed -------+-> abandoned
///      +-- no open, or refused: finished
///
/// A frame is written if there is credit and no other write. Until then `latest` holds only the
/// newest frame; `every` holds all frames up to `max_bytes`, including the one being written.
/// Further frames wait in the history; if the history lacks one, the watch ends. After the end of
/// the stream, pending frames are still written as credit arrives. Thread-safe.
///
/// A watcher that starts in the history reads it frame by frame, in both modes, and holds only the
/// frame being written. After the end of the history it continues with offered frames. If the
/// history drops its next frame, `latest` skips it; `every` ends, unless it has not received a
/// frame yet.
class WatchStateMachine : public std::enable_shared_from_this<WatchStateMachine> {
 public:
  /// Requires: `transport` lives until its Finish returns; this is held by shared_ptr. A frame of
  /// more than `max_bytes` ends the watch.
  WatchStateMachine(WatchTransport& transport, std::size_t max_bytes)
      : transport_(transport), max_bytes_(max_bytes) {}

  /// Starts the first read, or ends at once if `admission` is an error. Called once. Every watch,
  /// refused ones included, ends through this machine, so WatchTransport::Finish is called exactly
  /// once.
  void Start(absl::Status admission = absl::OkStatus());

  /// The pending read has returned this request.
  void ReadDone(const WatchRequest& request);
  /// The pending read has found the end of requests. The remaining credit is still used.
  void ReadEnded();
  /// The result of StartOpen; an error ends the watch.
  void Opened(const absl::StatusOr<WatchTerms>& terms);
  void WriteDone(bool ok);
  /// The client has disconnected.
  void Cancelled();

  /// Offers new frames in the order of their numbers. Ignores frames that were offered before.
  void Offer(std::span<const Published> frames);
  /// The stream has ended.
  void StreamEnded(const WatchEnd& end);
  /// Sends the drain end and finishes, with or without credit.
  void Drain();
  /// Ends a watch without `open` for `limit` at `now`, with DEADLINE_EXCEEDED (IDLE); 0: no limit.
  /// Returns the time of the next check.
  std::chrono::steady_clock::time_point EndIfSilent(std::chrono::milliseconds limit,
                                                    std::chrono::steady_clock::time_point now);
  /// Ends a watch without `open` with this error; other watches continue.
  void GiveWay(const absl::Status& status);
  /// Ends an open watch with this error at once, without pending frames and `ended`. Cuts a watch
  /// with a pending write, which may never complete.
  void GiveUp(const absl::Status& status);
  /// Ends at once, without a message.
  void Cut();

  WatchCounts counts() const;
  /// Bytes of pending frames.
  std::size_t held_bytes() const;
  /// Whether it reads the history, or keeps it for other watchers.
  bool goes_back() const;

 private:
  enum class Phase { kOpening, kWatching, kEnding, kAbandoned, kFinished };
  enum class Write { kOpened, kFrame, kEnded };

  // Actions to perform after the lock is released. The flags of their progress are already set.
  struct Actions {
    bool read = false;
    std::optional<Write> write;
    HeldFrames held;
    Published frame;
    WatchEnd end;
    std::uint64_t dropped = 0, oldest_sequence = 0;
    std::optional<absl::Status> finish;
    std::shared_ptr<ResultBroadcaster> leave;
  };

  // With the lock held:
  Actions Decide();
  void DecideWrite(Actions& actions);
  void TakeRequest(const WatchRequest& request);
  void Join(const WatchTerms& terms);
  void Take(const Published& published);
  bool IsHeld(std::uint64_t number) const;
  bool LeaveToHistory(const Published& published);
  void TakeHeld();
  void CatchUp();
  void MissUntil(std::uint64_t number);
  void End(WatchEnd end);
  void Refuse(absl::Status status);
  void Abandon(absl::Status status);
  void DropPending();
  // Without:
  template <typename Event>
  void On(Event event);
  void Perform(Actions actions);

  WatchTransport& transport_;
  const std::size_t max_bytes_;

  const std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();

  mutable std::mutex mutex_;  // Guards everything below.
  Phase phase_ = Phase::kOpening;
  WatchEnd end_;  // Set from kEnding on.
  std::shared_ptr<ResultBroadcaster> broadcaster_;
  WatchMode mode_ = WatchMode::kLatest;
  bool keeps_history_ = false;
  std::uint64_t credit_ = 0;
  bool half_closed_ = false;
  std::deque<Published> pending_;  // Pending frames.
  Published in_write_;             // Being written.
  std::size_t held_bytes_ = 0;     // Bytes of pending_ and in_write_.
  HeldFrames held_;                // State of the history at the start.
  std::uint64_t offered_ = 0;      // Number of the last offered frame; 0: none.
  std::uint64_t next_held_ = 0;    // Next number to read from the history; 0: live.
  std::uint64_t next_told_ = 0;    // Number of the next frame if none is dropped.
  bool reading_ = false, writing_ = false, opening_ = false;
  // Calls to the transport in progress; they must return before Finish.
  bool starting_read_ = false, cutting_ = false;
  bool owes_opened_ = false, owes_ended_ = false;
  WatchCounts counts_;
};

}  // namespace partiemc::server
