// How the messages of one stream flow: what may be read, computed and written when. What they are a
// handler knows, how they travel a transport (gRPC, or a test's memory).
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "server/base/call_errors.h"
#include "server/compute/busy_streams.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/stream/frame_assembler.h"

namespace partiemc::server {

/// What a request turned out to be.
enum class RequestKind { kMalformed, kEmpty, kOpen, kFrame };

/// What StreamTransport::StartWrite is to send.
enum class Outgoing { kOpened, kAnswer, kDraining };

/// What became of a frame.
struct Answered {
  bool is_result = false;           ///< Or a frame error.
  std::uint64_t last_sequence = 0;  ///< The last number that the stream has used up.
  std::uint64_t bytes = 0;          ///< Of the answer.
  /// Run by the worker once the answer is on its way, or waits for one before it. The transport may
  /// be gone by then. Empty: nothing is left to do.
  std::function<void()> afterwards = {};
};

/// A larger `open`, which brings a checkpoint, takes a time that no thread of gRPC has.
inline constexpr std::uint64_t kQuickOpenBytes = 64 << 10;

class StreamStateMachine;

/// Where a stream's messages come in and go out. There are `window` slots, each a request and the
/// answer to it, which it shares with the handler. StreamStateMachine never has more than one read,
/// one write and one computation going on, these on different slots, and calls neither of the two
/// with a lock held.
class StreamTransport {
 public:
  virtual ~StreamTransport() = default;

  /// Begins to read the next request into `slot`; ends in StreamStateMachine::ReadDone or
  /// ReadEnded.
  virtual void StartRead(std::size_t slot) = 0;
  /// Begins to write; ends in StreamStateMachine::WriteDone. `slot` counts for kAnswer only.
  virtual void StartWrite(Outgoing what, std::size_t slot) = 0;
  /// Has the read and the write that are going on fail soon, whatever the client does.
  virtual void Cut() = 0;
  /// The last call that the transport gets; a read may still be going on, nothing else. OK, or why
  /// the stream ended.
  virtual void Finish(const absl::Status& status) = 0;
  /// As CallChannel::peer. Called with the stream's lock held.
  virtual std::string peer() const { return {}; }
};

/// What the messages of a stream are, and the session behind them.
class StreamHandler {
 public:
  virtual ~StreamHandler() = default;

  /// Opens `stream` as the request in `slot` asks and prepares Outgoing::kOpened. Quick, but for a
  /// request of more than kQuickOpenBytes, which a worker opens. An error ends the stream.
  virtual absl::Status Open(std::size_t slot, const StreamStateMachine& stream) = 0;
  /// Turns the frame in `slot` into its answer, unless `cancelled`. Called by a worker, one frame
  /// of a stream at a time and in their order.
  virtual Answered Answer(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled) = 0;

  /// Whether the frame in `slot`, the oldest that is not answered, can be. One that waits for parts
  /// of others is asked for again by StreamStateMachine::LookAgain, and from time to time as
  /// LookEvery says. Called with the stream's lock held: it must not call the stream.
  virtual bool MayAnswer(std::size_t /*slot*/) { return true; }
  /// 0: nothing waits for anything but LookAgain.
  virtual std::chrono::milliseconds LookEvery() const { return std::chrono::milliseconds(0); }
  /// The bytes of which the frame in `slot` is computed; `bytes` of them came with it. 0: nothing
  /// is computed. Called with the stream's lock held.
  virtual std::uint64_t ComputedBytes(std::size_t /*slot*/, std::uint64_t bytes) const {
    return bytes;
  }
  /// The frame in `slot` has brought more than the server has room for. Returns whether its bytes
  /// were dropped, and it will be answered by `why`. Called with the stream's lock held, before
  /// MayAnswer.
  virtual bool DropFrame(std::size_t /*slot*/, const absl::Status& /*why*/) { return false; }
  /// Where frames come in parts: the same address for all calls that send parts of one stream.
  /// Called with the stream's lock held.
  virtual const void* Assembly() const { return nullptr; }
};

/// For how long a client may let a stream wait for it; 0: for ever.
struct IdleLimits {
  std::chrono::milliseconds opening{0};    ///< From the call to its `open`.
  std::chrono::milliseconds streaming{0};  ///< From one frame or taken answer to the next.
};

/// Seen from outside while the stream goes on.
struct StreamCounts {
  std::uint64_t frames = 0;        ///< Answered by a result.
  std::uint64_t frame_errors = 0;  ///< Answered by a frame error.
  std::uint64_t last_sequence = 0;
  std::chrono::steady_clock::time_point last_activity = std::chrono::steady_clock::now();
};

/// The state machine of one stream:
///
///   opening --open--> streaming --half-close, broken protocol, drain--> ending ----> finished
///      |                  |                                                |            ^
///      |                  +----------- cancelled, write failed ------------+-> abandoned
///      +-- no open, or refused: ending, with nothing to answer
///
/// While streaming, frame n lives in slot n % window from the start of its reading to the end of
/// its answer's writing, so that a client that does not read its answers is not read from either.
/// Ending answers what was read; abandoned answers nothing more. Safe from any thread.
///
/// A frame that comes in parts from several streams is computed when the handler of each says that
/// it may be. A stream that ends because of the server, or because of the stream that its parts
/// belong to, does not wait for that: frames that still lack something are not answered.
///
/// Memory: the bytes of requests that were read, `open` among them, and of answers that are not
/// written count against the budget of all streams. While something of a stream is in flight,
/// another frame is read only when the budget has room for one of the size of the last. A stream of
/// which nothing is in flight reads one frame when it has a permit (ReadPermits), which every
/// stream gets in its turn.
class StreamStateMachine final : public MemoryBudget::Waiter,
                                 public ReadPermits::Reader,
                                 public AssemblyMember,
                                 public std::enable_shared_from_this<StreamStateMachine> {
 public:
  /// `transport` and `handler` live until the transport's Finish returns, `pool` and `budget`
  /// longer. Held by shared_ptr only. `caller` is whose share of pool and budget it takes.
  StreamStateMachine(StreamTransport& transport, StreamHandler& handler, ComputePool& pool,
                     MemoryBudget& budget, std::size_t window,
                     std::shared_ptr<const CallerAccount> caller = nullptr);

  /// Begins with the first read, or, where `admission` is an error, ends with it at once. Called
  /// once. Every end of a stream goes through this state machine, that of a refused one too, so
  /// that StreamTransport::Finish is called exactly once, whatever the client does meanwhile.
  void Start(absl::Status admission = absl::OkStatus());

  /// The read that was begun last has brought a request of this kind and size.
  void ReadDone(RequestKind kind, std::uint64_t bytes);
  /// The read that was begun last has found that no request will come any more.
  void ReadEnded();
  void WriteDone(bool ok);
  /// Nobody waits for answers any more.
  void Cancelled();
  /// The client goes on with this stream in another call, and its connection may be dead: answers
  /// nothing more and ends with ABORTED.
  void TakenOver();
  /// Ends a stream that has not sent its `open` with this error; others go on.
  void GiveWay(const absl::Status& status);
  /// The server is going away: reads no further frame, sends Outgoing::kDraining, answers what was
  /// read and ends the stream with UNAVAILABLE.
  void Drain();
  /// Ends the stream with DEADLINE_EXCEEDED (IDLE) if at `now` it has waited for its client for too
  /// long: for a request, or, by cutting it, for answers to be taken. Waiting for a worker or for
  /// memory is not the client's doing and does not count. Gives the time before which there is no
  /// need to look again.
  std::chrono::steady_clock::time_point EndIfIdle(const IdleLimits& limits,
                                                  std::chrono::steady_clock::time_point now);

  StreamCounts counts() const;
  /// Becomes true when nobody waits for answers any more.
  const std::atomic<bool>& cancelled() const { return cancelled_; }

  void Granted(std::uint64_t bytes) override;
  void ReadPermitted() override;
  void ReadRevoked(const absl::Status& status) override;
  void LookAgain() override;
  void LeftOut(const absl::Status& status) override;

 private:
  enum class Phase { kOpening, kStreaming, kEnding, kAbandoned, kFinished };
  // For the read that goes on, or is to begin while nothing is in flight.
  enum class ReadPermit { kNone, kWaiting, kGiven };

  // What to do once the lock is released; the flags of what is going on are set already.
  struct Actions {
    std::optional<std::size_t> read, compute;  // Into or of this slot.
    std::uint64_t compute_bytes = 0;           // Of the frame, with its other parts.
    std::optional<Outgoing> write;
    std::size_t write_slot = 0;
    std::optional<absl::Status> finish;
    bool cut = false, stop_waiting = false;
    std::uint64_t give_back = 0;  // Bytes.
  };

  // With the lock held:
  Actions Decide();
  bool MayCompute();
  bool IsAllSaid();
  bool MayRead(Actions& actions);
  bool HasReadPermit();
  void PlanReadAhead();
  ReadPermits::Read NextRead() const;
  void DecideWrite(Actions& actions);
  void DecideMemory(Actions& actions);
  void TakeRequest(RequestKind kind, std::uint64_t bytes);
  void SetSlotBytes(std::uint64_t frame, std::uint64_t bytes);
  void End(absl::Status status);
  void Abandon(absl::Status status);
  // Without:
  template <typename Event>
  void On(Event event);
  void Perform(Actions actions);
  void Open();
  void Compute(std::size_t slot, Worker& worker);
  void Computed();

  StreamTransport& transport_;
  StreamHandler& handler_;
  ComputePool& pool_;
  MemoryBudget& budget_;
  const std::shared_ptr<const CallerAccount> caller_;
  const std::size_t window_;

  BusyStreams::Mark busy_mark_;       // The pool's.
  std::optional<Answered> answered_;  // From Compute to Computed, which it precedes.
  std::atomic<bool> cancelled_ = false;

  mutable std::mutex mutex_;  // Guards everything below.
  Phase phase_ = Phase::kOpening;
  absl::Status status_;  // Of the end, from kEnding on.
  // Frames so far: written_ <= computed_ <= read_ <= written_ + window_.
  std::uint64_t read_ = 0, computed_ = 0, written_ = 0;
  bool reading_ = false, computing_ = false, writing_ = false, opening_ = false;
  // Between the decision to read or cut and the return of the transport's call: the transport has
  // to stay.
  bool starting_read_ = false, cutting_ = false;
  bool owes_cut_ = false;
  bool owes_opened_ = false, owes_notice_ = false;
  bool waits_for_none_ = false;             // Frames that still lack something are not answered.
  Outgoing in_flight_ = Outgoing::kAnswer;  // What is being written.
  // Of the budget: what each slot holds, what has been set aside for a read that may begin, what
  // is to be given back once the lock is released.
  std::vector<std::uint64_t> slot_bytes_;
  std::uint64_t set_aside_ = 0, surplus_ = 0;
  std::uint64_t last_bytes_ = 0;  // Of the last frame, at least 1: what the next one may need.
  bool waiting_ = false;          // For `last_bytes_` of the budget.
  ReadPermit read_permit_ = ReadPermit::kNone;
  StreamCounts counts_;
};

}  // namespace partiemc::server
