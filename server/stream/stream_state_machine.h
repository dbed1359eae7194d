// Decides when a stream reads, computes and writes. A handler interprets the messages; a transport
// carries them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "common/mutex.h"
#include "server/base/call_errors.h"
#include "server/base/serialized_call.h"
#include "server/compute/busy_streams.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/stream/frame_assembler.h"

namespace partiemc::server {

enum class RequestKind { kMalformed, kEmpty, kOpen, kFrame };

/// The messages that StreamTransport::StartWrite sends.
enum class Outgoing { kOpened, kAnswer, kDraining };

struct Answered {
  bool is_result = false;           ///< False: a frame error.
  std::uint64_t last_sequence = 0;  ///< The last sequence number that the stream has used.
  std::uint64_t bytes = 0;          ///< Size of the response.
  /// Runs after the response is written or queued behind another one; the transport may be gone.
  std::function<void()> afterwards = {};
};

/// A larger `open` contains a checkpoint; a compute thread opens the stream then.
inline constexpr std::uint64_t kQuickOpenBytes = 64 << 10;

class StreamStateMachine;

/// Carries the messages of a stream. There are `window` slots, each with a request and its
/// response, which the transport shares with the handler. StreamStateMachine has at most one read,
/// one write and one computation in progress, each on its own slot, and calls the transport without
/// a lock.
class StreamTransport {
 public:
  virtual ~StreamTransport() = default;

  /// Starts to read the next request into `slot`; completes by ReadDone or ReadEnded.
  virtual void StartRead(std::size_t slot) = 0;
  /// Starts a write; completes by WriteDone. `slot` is used for kAnswer only.
  virtual void StartWrite(Outgoing what, std::size_t slot) = 0;
  /// Makes the pending read and write fail soon.
  virtual void Cut() = 0;
  /// The last call to the transport; only a read may still be in progress.
  virtual void Finish(const absl::Status& status) = 0;
  /// As CallChannel::peer. Called with the stream's lock held.
  virtual std::string peer() const { return {}; }
};

/// Interprets the messages of a stream and computes its frames.
class StreamHandler {
 public:
  virtual ~StreamHandler() = default;

  /// Opens `stream` by the request in `slot` and prepares Outgoing::kOpened. An error ends the
  /// stream.
  virtual absl::Status Open(std::size_t slot, const StreamStateMachine& stream) = 0;
  /// Turns the frame in `slot` into its response, unless `cancelled`. Called by a worker, for one
  /// frame of a stream at a time, in their order.
  virtual Answered Answer(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled) = 0;

  /// Whether the oldest frame without a response, in `slot`, can be computed. A frame that waits
  /// for parts is checked again at StreamStateMachine::LookAgain, and at intervals of LookEvery.
  /// Called with the stream's lock held: must not call the stream.
  virtual bool MayAnswer(std::size_t /*slot*/) { return true; }
  /// 0: only LookAgain.
  virtual std::chrono::milliseconds LookEvery() const { return std::chrono::milliseconds(0); }
  /// Size of the whole frame in `slot`, whose own message has `bytes`. 0: nothing is computed.
  /// Called with the stream's lock held.
  virtual std::uint64_t ComputedBytes(std::size_t /*slot*/, std::uint64_t bytes) const {
    return bytes;
  }
  /// There is no memory for the frame in `slot`. Returns whether its bytes were dropped; `why` is
  /// then its response. Called with the stream's lock held, before MayAnswer.
  virtual bool DropFrame(std::size_t /*slot*/, const absl::Status& /*why*/) { return false; }
  /// The same address for all calls that send parts of one stream; null without parts. Called with
  /// the stream's lock held.
  virtual const void* Assembly() const { return nullptr; }
};

/// How long a client may keep a stream waiting; 0: no limit.
struct IdleLimits {
  std::chrono::milliseconds opening{0};    ///< From the call to its `open`.
  std::chrono::milliseconds streaming{0};  ///< Between frames, and from a write's start to its end.
};

struct StreamCounts {
  std::uint64_t frames = 0;        ///< Answered by a result.
  std::uint64_t frame_errors = 0;  ///< Answered by a frame error.
  std::uint64_t last_sequence = 0;
  std::chrono::steady_clock::time_point last_activity = std::chrono::steady_clock::now();
};

/// The state machine of one stream (phases: server/base/call_state.h):
///
///   opening --open--> serving --half-close, broken protocol, drain--> ending or closing -->
///   finished
///      |                 |                                                |                    ^
///      |                 +----------- cancelled, write failed ------------+--> abandoned ------+
///      +-- no open, or refused: ending, with nothing to answer
///
/// While serving, frame n uses slot n % window from the start of its read to the end of its
/// response's write. So a client that does not read its responses is not read from either.
/// Ending answers all frames that were read; abandoned sends nothing more. Thread-safe.
///
/// A frame in parts is computed when MayAnswer of each of its streams permits it. Closing, caused
/// by the server or by the stream that the parts belong to, does not answer frames that lack parts.
///
/// Memory: the bytes of requests that were read and of responses that are not written count against
/// the budget of all streams. While a stream has frames in flight, it reads another frame only if
/// the budget has room for one of the size of the last. A stream without frames in flight reads one
/// frame when it has a permit (ReadPermits).
class StreamStateMachine final : public SerializedCall,
                                 public MemoryBudget::Waiter,
                                 public ReadPermits::Reader,
                                 public AssemblyMember {
 public:
  /// Requires: `transport` and `handler` live until the transport's Finish returns, `pool` and
  /// `budget` longer. Memory and computing count for `caller`.
  StreamStateMachine(StreamTransport& transport, StreamHandler& handler, ComputePool& pool,
                     MemoryBudget& budget, std::size_t window,
                     std::shared_ptr<const CallerAccount> caller = nullptr);

  /// Starts the first read, or ends at once if `admission` is an error. Called once. Every stream,
  /// refused ones included, ends through this machine, so StreamTransport::Finish is called exactly
  /// once.
  void Start(absl::Status admission = absl::OkStatus());

  /// The pending read has returned a request of this kind and size.
  void ReadDone(RequestKind kind, std::uint64_t bytes);
  /// The pending read has found the end of requests.
  void ReadEnded();
  void WriteDone(bool ok);
  /// The client has disconnected.
  void Cancelled();
  /// The client has resumed this stream in another call, and its connection may be dead: abandons
  /// the stream with ABORTED.
  void TakenOver();
  /// Ends a stream that has not sent its `open` with this error; other streams go on.
  void GiveWay(const absl::Status& status);
  /// Reads no further frame, sends Outgoing::kDraining, answers what was read, and ends the stream
  /// with UNAVAILABLE.
  void Drain();
  /// Ends the stream with DEADLINE_EXCEEDED (IDLE) if at `now` the client has exceeded a limit,
  /// either without a request or, by cutting it, without taking a response. Waiting for a worker or
  /// for memory does not count. Returns the time of the next check.
  std::chrono::steady_clock::time_point EndIfIdle(const IdleLimits& limits,
                                                  std::chrono::steady_clock::time_point now);

  StreamCounts counts() const;
  /// Becomes true when no response can be delivered any more.
  const std::atomic<bool>& cancelled() const { return cancelled_; }

  void Granted(std::uint64_t bytes) override;
  void ReadPermitted() override;
  void ReadRevoked(const absl::Status& status) override;
  void LookAgain() override;
  void LeftOut(const absl::Status& status) override;

  std::shared_ptr<StreamStateMachine> shared_from_this() {
    return std::static_pointer_cast<StreamStateMachine>(SerializedCall::shared_from_this());
  }

 private:
  void Decide() override ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DecideMemory() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DecideRead() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DecideCompute() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DecideFinish() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool IsAllSaid() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  ReadPermits::Read NextRead() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Read(Reading what) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ReadAhead() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Write(Writing what) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void TakeRequest(RequestKind kind, std::uint64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void OpenLater(std::uint64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void SetSlotBytes(std::uint64_t frame, std::uint64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void End(absl::Status status, Phase phase = Phase::kEnding) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Abandon(absl::Status status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void AbandonAndCut(absl::Status status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Actions:
  void ReturnMemory() ABSL_LOCKS_EXCLUDED(mutex_);
  void Open() ABSL_LOCKS_EXCLUDED(mutex_);
  void Compute(std::size_t slot, Worker& worker) ABSL_LOCKS_EXCLUDED(mutex_);
  void Computed() ABSL_LOCKS_EXCLUDED(mutex_);

  StreamTransport& transport_;
  StreamHandler& handler_;
  ComputePool& pool_;
  MemoryBudget& budget_;
  const std::shared_ptr<const CallerAccount> caller_;
  const std::size_t window_;

  BusyStreams::Mark busy_mark_;       // The pool's.
  std::optional<Answered> answered_;  // Passed from Compute to Computed, which runs after it.
  std::atomic<bool> cancelled_ = false;

  absl::Status status_ ABSL_GUARDED_BY(mutex_);  // The stream's final status, once it is ending.
  // Numbers of frames: written_ <= computed_ <= read_ <= written_ + window_.
  std::uint64_t read_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t computed_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t written_ ABSL_GUARDED_BY(mutex_) = 0;
  // Bytes that each slot holds in the budget.
  std::vector<std::uint64_t> slot_bytes_ ABSL_GUARDED_BY(mutex_);
  // Bytes that ReturnMemory gives back to the budget.
  std::uint64_t surplus_ ABSL_GUARDED_BY(mutex_) = 0;
  // Size of the last frame, at least 1: the estimate for the next one.
  std::uint64_t last_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  StreamCounts counts_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
