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
  bool is_result = false;           ///< False: a frame error, or `is_cancelled`.
  bool is_cancelled = false;        ///< The call was cancelled during the computation.
  std::uint64_t last_sequence = 0;  ///< The last sequence number that the stream has used.
  std::uint64_t bytes = 0;          ///< Size of the response.
  /// Function to run after the response's write has started or was queued behind another write. The
  /// transport may no longer exist then.
  std::function<void()> afterwards = {};
};

/// Limit for an `open` that is handled at once. A larger `open` contains a checkpoint, so a compute
/// thread opens the stream.
inline constexpr std::uint64_t kQuickOpenBytes = 64 << 10;

class StreamStateMachine;

/// Carries the messages of a stream. There are `window` slots; each holds a request and its
/// response. The transport shares the slots with the handler. StreamStateMachine has at most one
/// read, one write and one computation in progress, each on a different slot. It holds no lock when
/// it calls the transport, except for `peer`.
class StreamTransport {
 public:
  virtual ~StreamTransport() = default;

  /// Starts to read the next request into `slot`; completes by ReadDone or ReadEnded.
  virtual void StartRead(std::size_t slot) = 0;
  /// Starts a write; completes by WriteDone. `slot` is used only if `what` is kAnswer.
  virtual void StartWrite(Outgoing what, std::size_t slot) = 0;
  /// Makes the pending read and write fail soon.
  virtual void Cut() = 0;
  /// Ends the call with `status`. This is the last call to the transport; at most a read may still
  /// be in progress.
  virtual void Finish(const absl::Status& status) = 0;
  /// Address of the client, see CallChannel::peer. Called with the stream's lock held.
  virtual std::string peer() const { return {}; }
};

/// Interprets the messages of a stream and computes its frames.
class StreamHandler {
 public:
  virtual ~StreamHandler() = default;

  /// Opens `stream` as the request in `slot` demands, and prepares the message Outgoing::kOpened.
  /// An error ends the stream.
  virtual absl::Status Open(std::size_t slot, const StreamStateMachine& stream) = 0;
  /// Computes the response to the frame in `slot`, unless `cancelled`. Called on a compute thread,
  /// for one frame of a stream at a time, in the order of the frames.
  virtual Answered Answer(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled) = 0;

  /// Whether the frame in `slot`, the oldest one without a response, can be computed. A frame that
  /// waits for parts is checked again when StreamStateMachine::LookAgain is called, and at
  /// intervals of LookEvery. Called with the stream's lock held, so it must not call the stream.
  virtual bool MayAnswer(std::size_t /*slot*/) { return true; }
  /// Interval of the checks of a frame that waits for parts. 0: only LookAgain triggers a check.
  virtual std::chrono::milliseconds LookEvery() const { return std::chrono::milliseconds(0); }
  /// Size of the whole frame in `slot`; `bytes` is the size of its own message. Returns 0 if this
  /// call computes nothing. Called with the stream's lock held.
  virtual std::uint64_t ComputedBytes(std::size_t /*slot*/, std::uint64_t bytes) const {
    return bytes;
  }
  /// Called if there is no memory for the frame in `slot`. Returns whether the handler has dropped
  /// the frame's bytes; `why` then becomes its response. Called with the stream's lock held, before
  /// MayAnswer.
  virtual bool DropFrame(std::size_t /*slot*/, const absl::Status& /*why*/) { return false; }
  /// An address that is the same for all calls that send parts of one stream. Null if frames arrive
  /// whole. Called with the stream's lock held.
  virtual const void* Assembly() const { return nullptr; }
};

/// Time for which a client may keep a stream waiting; 0: no limit.
struct IdleLimits {
  std::chrono::milliseconds opening{0};    ///< From the call's start to its `open`.
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
///   opening --open--> serving --half-close, bad request, drain--> ending or closing --> finished
///      |                 |                                            |                     ^
///      |                 +----------- cancelled, write failed --------+--> abandoned -------+
///      +-- no open, or refused: ending, with nothing to answer
///
/// While serving, frame n uses slot n % window from the start of its read to the end of its
/// response's write. So if a client does not read its responses, the server stops reading from it.
/// In the phase `ending` the stream still answers all frames that it has read. In the phase
/// `closing` it does so too, except for frames with missing parts. In the phase `abandoned` it
/// sends nothing more. Thread-safe.
///
/// A frame that arrives in parts is computed when MayAnswer permits it for each of the calls. A
/// drain, or an error that ends the call of part 0, leads to the phase `closing`.
///
/// Memory: the budget of all streams counts requests that were read and responses that are not
/// written yet. While a stream has frames in flight, it reads another frame only if the budget has
/// room for a frame of the last frame's size. A stream without frames in flight reads one frame
/// when it has a permit (ReadPermits).
class StreamStateMachine final : public SerializedCall,
                                 public MemoryBudget::Waiter,
                                 public ReadPermits::Reader,
                                 public AssemblyMember {
 public:
  /// Requires: `transport` and `handler` live until the transport's Finish returns; `pool` and
  /// `budget` live longer. Memory and computing time are charged to `caller`.
  StreamStateMachine(StreamTransport& transport, StreamHandler& handler, ComputePool& pool,
                     MemoryBudget& budget, std::size_t window,
                     std::shared_ptr<const CallerAccount> caller = nullptr);

  /// Starts the first read, or ends at once if `admission` is an error. Called once. Every stream
  /// ends through this machine, even a refused one. So StreamTransport::Finish is called exactly
  /// once.
  void Start(absl::Status admission = absl::OkStatus());

  /// The pending read has completed with a part, and the caller is about to give it to the
  /// assembler. ReadDone follows. Until then LeftOut does not end this stream, so that the part
  /// gets its response even if it completes the last frame.
  void PartArrives();
  /// The pending read has completed with a request of this kind and size.
  void ReadDone(RequestKind kind, std::uint64_t bytes);
  /// The pending read has completed without a request: the client will send no more.
  void ReadEnded();
  void WriteDone(bool ok);
  /// The client has disconnected.
  void Cancelled();
  /// The client has resumed this stream in another call, so the connection of this call may be
  /// dead. Abandons the stream with ABORTED.
  void TakenOver();
  /// Ends this stream with this error if it has not received its `open`. Otherwise has no effect.
  void GiveWay(const absl::Status& status);
  /// Stops reading frames, sends Outgoing::kDraining, responds to the frames that were read (except
  /// frames with missing parts), and ends the stream with UNAVAILABLE. A stream that is not serving
  /// gets no kDraining.
  void Drain();
  /// Ends the stream with DEADLINE_EXCEEDED (IDLE) if the client has exceeded a limit at `now`. The
  /// client has either not sent a request, or not received a response; in the second case the call
  /// is cut. Time in which the server lets the client wait does not count: a frame's wait for parts
  /// or a worker, and the stream's wait for a permit to read. Returns the time of the next check.
  std::chrono::steady_clock::time_point EndIfIdle(const IdleLimits& limits,
                                                  std::chrono::steady_clock::time_point now);

  StreamCounts counts() const;
  /// Becomes true when responses can no longer be delivered.
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
  std::uint64_t ExpectedBytes() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
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

  BusyStreams::Mark busy_mark_;       // Used by the pool only.
  std::optional<Answered> answered_;  // Passed from Compute to Computed, which runs after it.
  std::atomic<bool> cancelled_ = false;

  absl::Status status_ ABSL_GUARDED_BY(mutex_);  // The stream's final status, once it is ending.
  // Numbers of frames that were read, computed and written: written_ <= computed_ <= read_ <=
  // written_ + window_.
  std::uint64_t read_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t computed_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t written_ ABSL_GUARDED_BY(mutex_) = 0;
  bool part_arrives_ ABSL_GUARDED_BY(mutex_) = false;  // Between PartArrives and ReadDone.
  // Bytes that each slot holds in the memory budget.
  std::vector<std::uint64_t> slot_bytes_ ABSL_GUARDED_BY(mutex_);
  // Bytes that the next ReturnMemory gives back to the budget.
  std::uint64_t surplus_ ABSL_GUARDED_BY(mutex_) = 0;
  // Size of the last frame, at least 1. It is the estimate for the size of the next frame.
  std::uint64_t last_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  StreamCounts counts_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
