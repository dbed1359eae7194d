// How results flow to one watcher: credits, drops, ends. It knows neither what the messages are nor
// how they travel; a transport (gRPC, or a test's memory) does.
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

/// What a watcher asked for when it came.
struct WatchTerms {
  std::shared_ptr<ResultBroadcaster> broadcaster;  ///< Of the stream.
  WatchMode mode = WatchMode::kLatest;
  std::uint64_t credit = 1;
  /// The frames that are held from this sequence number on come first; else the newest one.
  std::optional<std::uint64_t> from_sequence = {};
  /// The history stays when the stream has ended, for as long as the broadcaster does: others may
  /// ask for it.
  bool keeps_history = false;
};

/// What a request turned out to be.
struct WatchRequest {
  enum class Kind { kMalformed, kEmpty, kOpen, kCredit };
  Kind kind = Kind::kMalformed;
  std::uint64_t credit = 0;
};

/// Where a watcher's messages come in and go out. WatchStateMachine never has more than one read
/// and one write going on, and never calls the transport with a lock held.
class WatchTransport {
 public:
  virtual ~WatchTransport() = default;

  /// Begins to read the next request; ends in WatchStateMachine::ReadDone or ReadEnded.
  virtual void StartRead() = 0;
  /// Begins to look for the stream of the `open` that was just read, and prepares what WriteOpened
  /// sends; ends in WatchStateMachine::Opened, from within or later.
  virtual void StartOpen() = 0;

  /// Each begins to write; ends in WatchStateMachine::WriteDone.
  virtual void WriteOpened(const HeldFrames& held) = 0;
  /// `oldest_sequence`: what can be asked for now.
  virtual void WriteFrame(const Published& published, std::uint64_t dropped,
                          std::uint64_t oldest_sequence) = 0;
  virtual void WriteEnded(const WatchEnd& end, std::uint64_t dropped) = 0;

  /// Has reads and writes that go on fail soon, whatever the other side does.
  virtual void Cut() = 0;
  /// The last call that the transport gets; a read may still be going on, nothing else.
  virtual void Finish(const absl::Status& status) = 0;
};

/// Frames count from the first that was offered on.
struct WatchCounts {
  std::uint64_t frames = 0;         ///< Given to the transport.
  std::uint64_t dropped = 0;        ///< Never to be.
  std::size_t most_held_bytes = 0;  ///< At any one time, of those not taken yet.
};

/// The state machine of one watcher:
///
///   opening --open--> watching --stream ends, fell behind, drain--> ending ----> finished
///      |                 |                                            |             ^
///      |                 +------------ cancelled, write failed -------+-> abandoned
///      +-- no open, or refused: finished
///
/// A frame is written when there is credit and no other write goes on. Until then `latest` holds
/// the newest one only; `every` holds all of them, at most `max_bytes`, the one being written
/// included; what there would be more waits in the stream's history, and where that does not have
/// it either, the watch ends. Ending because the stream did, what is held is still written as
/// credit comes. Safe from any thread.
///
/// A watcher that goes back takes frame after frame out of the history, in both modes, and holds
/// none but the one being written. From the first that is not in the history yet it goes on with
/// what is offered. What the history has dropped meanwhile, `latest` misses; `every` ends, unless
/// it has not had a frame yet.
class WatchStateMachine : public std::enable_shared_from_this<WatchStateMachine> {
 public:
  /// `transport` lives until its Finish returns. Held by shared_ptr only. A frame of more than
  /// `max_bytes` ends the watch.
  WatchStateMachine(WatchTransport& transport, std::size_t max_bytes)
      : transport_(transport), max_bytes_(max_bytes) {}

  /// Begins with the first read, or, where `admission` is an error, ends with it at once. Called
  /// once. Every end of a watch goes through this state machine, that of a refused one too, so that
  /// WatchTransport::Finish is called exactly once, whatever the watcher does meanwhile.
  void Start(absl::Status admission = absl::OkStatus());

  /// The read that was begun last has brought this request.
  void ReadDone(const WatchRequest& request);
  /// ... has found that no request will come any more: what there is credit for is still written.
  void ReadEnded();
  /// The stream was found; an error ends the watch.
  void Opened(const absl::StatusOr<WatchTerms>& terms);
  void WriteDone(bool ok);
  /// Nobody is there any more.
  void Cancelled();

  /// New frames, in the order of their numbers; those that were offered before are passed over.
  void Offer(std::span<const Published> frames);
  /// No more will come.
  void StreamEnded(const WatchEnd& end);
  /// The server is going away: says so and ends, credit or not.
  void Drain();
  /// Ends a watch with DEADLINE_EXCEEDED (IDLE) that at `now` has not sent its `open` for `limit`;
  /// 0: for ever. Gives the time before which there is no need to look again.
  std::chrono::steady_clock::time_point EndIfSilent(std::chrono::milliseconds limit,
                                                    std::chrono::steady_clock::time_point now);
  /// Ends a watch that has not sent its `open` with this error; others go on.
  void GiveWay(const absl::Status& status);
  /// Ends an open watch with this error, at once: what is held is not written, nor `ended`. One
  /// that is being written to is cut, as nobody knows when it will take that.
  void GiveUp(const absl::Status& status);
  /// Ends at once, said or not.
  void Cut();

  WatchCounts counts() const;
  /// Of the frames that the watcher has not taken yet.
  std::size_t held_bytes() const;
  /// Whether it still takes frames out of the stream's history, or wants it kept for others.
  bool goes_back() const;

 private:
  enum class Phase { kOpening, kWatching, kEnding, kAbandoned, kFinished };
  enum class Write { kOpened, kFrame, kEnded };

  // What to do once the lock is released; the flags of what is going on are set already.
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
  WatchEnd end_;  // From kEnding on.
  std::shared_ptr<ResultBroadcaster> broadcaster_;
  WatchMode mode_ = WatchMode::kLatest;
  bool keeps_history_ = false;
  std::uint64_t credit_ = 0;
  bool half_closed_ = false;
  std::deque<Published> pending_;  // Not yet written.
  Published in_write_;             // Its memory is the connection's for now.
  std::size_t held_bytes_ = 0;     // Of both.
  HeldFrames held_;                // When it joined.
  std::uint64_t offered_ = 0;      // The number of the last frame offered; 0: none yet.
  std::uint64_t next_held_ = 0;    // Of the next one to take out of the history; 0: goes on live.
  std::uint64_t next_told_ = 0;    // The number that the next frame has if none is dropped.
  bool reading_ = false, writing_ = false, opening_ = false;
  // Between the decision and the return of the transport's call: the transport has to stay.
  bool starting_read_ = false, cutting_ = false;
  bool owes_opened_ = false, owes_ended_ = false;
  WatchCounts counts_;
};

}  // namespace partiemc::server
