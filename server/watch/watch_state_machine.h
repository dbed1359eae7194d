// Controls the flow of results to one watcher: credit, dropped frames, the end. Independent of
// messages and transport.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/mutex.h"
#include "server/base/serialized_call.h"
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
  /// Start with this sequence number, from the history. Absent: start with the newest frame.
  std::optional<std::uint64_t> from_sequence = {};
};

/// Limits of a watch whose stream has ended.
struct PauseLimits {
  std::chrono::milliseconds pause{0};  ///< Without credit.
  std::chrono::milliseconds write{0};  ///< From a write's start to its end.
};

/// A parsed request.
struct WatchRequest {
  enum class Kind { kMalformed, kEmpty, kOpen, kCredit };
  Kind kind = Kind::kMalformed;
  std::uint64_t credit = 0;
};

/// Carries the messages of a watch. WatchStateMachine has at most one read and one write in
/// progress. It never calls the transport while it holds a lock.
class WatchTransport {
 public:
  virtual ~WatchTransport() = default;

  /// Starts to read the next request; completes by WatchStateMachine::ReadDone or ReadEnded.
  virtual void StartRead() = 0;
  /// Starts to look up the stream that the `open` just read names, and prepares the message of
  /// WriteOpened; completes by WatchStateMachine::Opened, during this call or later.
  virtual void StartOpen() = 0;

  /// Each of these three starts a write, which completes by WatchStateMachine::WriteDone.
  /// WriteFrame may complete by WriteSkipped or WriteRefused instead. `dropped`: number of results
  /// that were not sent since the last frame that was sent.
  virtual void WriteOpened(const HeldFrames& held) = 0;
  /// `oldest_sequence`: the oldest frame that a watcher can request now.
  virtual void WriteFrame(const Published& published, std::uint64_t dropped,
                          std::uint64_t oldest_sequence) = 0;
  virtual void WriteEnded(const WatchEnd& end, std::uint64_t dropped) = 0;

  /// Makes the pending read and write fail soon.
  virtual void Cut() = 0;
  /// Ends the call with `status`. This is the last call to the transport; at most a read may still
  /// be in progress.
  virtual void Finish(const absl::Status& status) = 0;
};

/// Totals of a watch, counted from the frame with which it starts (ResultBroadcaster::Join).
struct WatchCounts {
  std::uint64_t frames = 0;         ///< Passed to the transport, and not skipped or refused by it.
  std::uint64_t dropped = 0;        ///< Never sent.
  std::size_t most_held_bytes = 0;  ///< Largest value of held_bytes().
};

/// The state machine of one watcher (phases: server/base/call_state.h). In the phase `ending` the
/// message `ended` must still be sent. In the phase `closing` it is being written, or the watch was
/// refused and gets only a status:
///
///   opening --open--> serving --stream ends, fell behind, drain--> ending --> closing --> finished
///      |                 |                                            |          |          ^
///      |                 +------------ cancelled, write failed -------+----------+-> abandoned
///      +-- no open, or refused: closing
///
/// A frame is written when the client has given credit and no other write is in progress. Until
/// then a watch in mode `latest` holds only the newest frame. A watch in mode `every` holds all
/// frames, up to `max_bytes` including the frame being written; it reads further frames from the
/// history later. If the history lacks such a frame, the watch ends. After the end of the stream,
/// pending frames are still written as credit arrives, unless the stream ended with an error
/// status, or the client pauses for too long. Thread-safe.
///
/// A watcher that starts in the history reads it frame by frame, in both modes, and holds only the
/// frame being written. When it has read the whole history, it continues with the frames that are
/// offered. If the history drops the frame that the watcher needs next, `latest` skips the frame.
/// `every` ends, unless it has not received any frame yet.
class WatchStateMachine final : public SerializedCall {
 public:
  /// Requires: `transport` lives until its Finish returns; this object is held by shared_ptr. A
  /// frame of more than `max_bytes` ends the watch.
  WatchStateMachine(WatchTransport& transport, std::size_t max_bytes)
      : SerializedCall(MachineKind::kWatch), transport_(transport), max_bytes_(max_bytes) {}

  /// Starts the first read, or ends at once if `admission` is an error. Called once. Every watch
  /// ends through this machine, even a refused one. So WatchTransport::Finish is called exactly
  /// once.
  void Start(absl::Status admission = absl::OkStatus());

  /// The pending read has completed with this request.
  void ReadDone(const WatchRequest& request);
  /// The pending read has completed without a request: the client will send no more. Results are
  /// still sent until the credit is used.
  void ReadEnded();
  /// Completes StartOpen. If `terms` is an error, the watch ends.
  void Opened(const absl::StatusOr<WatchTerms>& terms);
  void WriteDone(bool ok);
  /// Instead of WriteDone: the transport will not write the frame of WriteFrame. The watcher misses
  /// the frame and keeps its credit.
  void WriteSkipped();
  /// As WriteSkipped, and ends the watch with this error.
  void WriteRefused(const absl::Status& status);
  /// The client has disconnected.
  void Cancelled();

  /// Offers new frames in the order of their result numbers. Ignores frames that were offered
  /// before.
  void Offer(std::span<const Published> frames);
  /// The stream has ended.
  void StreamEnded(const WatchEnd& end);
  /// Sends the message `ended` with the reason of the drain and finishes. Does not wait for credit.
  /// The client of a watch that is not open receives only the status.
  void Drain();
  /// Ends the watch with DEADLINE_EXCEEDED (IDLE) if it has received no `open` within `limit`, at
  /// the time `now`. `limit` 0: no limit. Returns the time of the next check.
  std::chrono::steady_clock::time_point EndIfSilent(std::chrono::milliseconds limit,
                                                    std::chrono::steady_clock::time_point now);
  /// Ends the watch with DEADLINE_EXCEEDED (IDLE) if its stream has ended and its client has
  /// exceeded a limit at `now`: it has given no credit for `pause`, or has not accepted a write
  /// within `write`; in the second case at once, as GiveUp. A limit of 0: none. Returns the time of
  /// the next check.
  std::chrono::steady_clock::time_point EndIfPaused(const PauseLimits& limits,
                                                    std::chrono::steady_clock::time_point now);
  /// Ends this watch with this error if it has received no `open`. Otherwise has no effect.
  void GiveWay(const absl::Status& status);
  /// Ends an open watch with this error at once. Pending frames and the message `ended` are not
  /// sent. A pending write is cut, because it may never complete.
  void GiveUp(const absl::Status& status);
  /// Ends at once, without a message.
  void Cut();

  WatchCounts counts() const;
  /// Bytes of the pending frames and of the frame being written (Published::pending_bytes).
  std::size_t held_bytes() const;
  /// Whether this watch reads the history.
  bool goes_back() const;

  std::shared_ptr<WatchStateMachine> shared_from_this() {
    return std::static_pointer_cast<WatchStateMachine>(SerializedCall::shared_from_this());
  }

 private:
  void Decide() override ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DecideWrite() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Write(Writing what, Action action) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void WriteFrame() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Published TakeInWrite() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Published TakeBackWrite() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void TakeRequest(const WatchRequest& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Join(const WatchTerms& terms) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Take(const Published& published) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool IsHeld(std::uint64_t number) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool LeaveToHistory(const Published& published) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void TakeHeld() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void CatchUp() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void MissUntil(std::uint64_t number) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void BeginEnding(WatchEnd end) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void NoteMove() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void End(WatchEnd end) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Refuse(absl::Status status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Abandon(absl::Status status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DropPending() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool IsOpen() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  WatchTransport& transport_;
  const std::size_t max_bytes_;

  const std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();

  // While the watch is ending: the last time at which the client gave credit or accepted a write.
  std::chrono::steady_clock::time_point moved_ ABSL_GUARDED_BY(mutex_);
  WatchEnd end_ ABSL_GUARDED_BY(mutex_);  // Set from kEnding on.
  std::shared_ptr<ResultBroadcaster> broadcaster_ ABSL_GUARDED_BY(mutex_);
  WatchMode mode_ ABSL_GUARDED_BY(mutex_) = WatchMode::kLatest;
  std::uint64_t credit_ ABSL_GUARDED_BY(mutex_) = 0;
  std::deque<Published> pending_ ABSL_GUARDED_BY(mutex_);
  Published in_write_ ABSL_GUARDED_BY(mutex_);
  std::size_t held_bytes_ ABSL_GUARDED_BY(mutex_) = 0;     // Of pending_ and in_write_.
  std::uint64_t offered_ ABSL_GUARDED_BY(mutex_) = 0;      // Last offered number; 0: none.
  std::uint64_t next_held_ ABSL_GUARDED_BY(mutex_) = 0;    // Next number of the history; 0: live.
  std::uint64_t next_told_ ABSL_GUARDED_BY(mutex_) = 0;    // Number after the last written frame.
  std::uint64_t told_before_ ABSL_GUARDED_BY(mutex_) = 0;  // next_told_ before in_write_.
  WatchCounts counts_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
