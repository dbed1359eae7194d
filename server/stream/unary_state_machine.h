// How a call of one request and one answer goes: what is read, computed and written when. It knows
// neither what the messages are nor how they travel; a transport (gRPC, or a test's memory) does.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// What a call is for. Frames never keep a call for information out, a probe say: each kind has
/// places of its own, and information, which is small, takes its memory whether there is room or
/// not.
enum class UnaryKind { kFrame, kInformation, kProbe };

/// Where a call's request comes in and its answer goes out. UnaryStateMachine never calls it with a
/// lock held.
class UnaryTransport {
 public:
  virtual ~UnaryTransport() = default;

  /// Begins to read the request; ends in UnaryStateMachine::ReadDone or ReadEnded.
  virtual void StartRead() = 0;
  /// Turns the request into the answer and gives the size of the answer. An error ends the call.
  /// `worker` is null where the machine has no pool.
  virtual absl::StatusOr<std::uint64_t> Answer(Worker* worker) = 0;
  /// Begins to write the answer; ends in UnaryStateMachine::WriteDone.
  virtual void StartWrite() = 0;
  /// Has the read and the write that are going on fail soon, whatever the client does.
  virtual void Cut() = 0;
  /// The last call that the transport gets; a read may still be going on, nothing else.
  virtual void Finish(const absl::Status& status) = 0;
};

/// For how long a client may keep a call waiting; 0: for ever.
struct UnaryLimits {
  std::chrono::milliseconds request{0};  ///< From the begin of the call to its request.
  std::chrono::milliseconds answer{0};   ///< From the begin of the answer's writing to its end.
};

/// The state machine of one call:
///
///   reading --request--> working --answer--> writing --> ending ----> finished
///      |                    |                   |                        ^
///      +--------------------+----- cancelled ---+-----> abandoned -------+
///      +-- refused, no request, drained: ending
///
/// Memory: the request counts against the budget of all streams from its reading on, its answer
/// until the connection has taken it. A frame that the budget has no room for ends the call, as an
/// answer to it does. Safe from any thread.
class UnaryStateMachine final : public std::enable_shared_from_this<UnaryStateMachine> {
 public:
  /// `transport` lives until its Finish returns, the others longer. Without a pool the answer is
  /// made by the thread that brings the request. Held by shared_ptr only. `caller` is whose share
  /// of budget and pool it takes.
  UnaryStateMachine(UnaryTransport& transport, MemoryBudget& budget, ComputePool* pool,
                    std::shared_ptr<const CallerAccount> caller = nullptr,
                    UnaryKind kind = UnaryKind::kFrame)
      : transport_(transport),
        budget_(budget),
        pool_(pool),
        caller_(std::move(caller)),
        kind_(kind) {}

  /// Begins with the read, or, where `admission` is an error, ends with it at once. Called once.
  void Start(absl::Status admission);

  void ReadDone(std::uint64_t bytes);
  /// No request will come.
  void ReadEnded();
  void WriteDone(bool ok);
  /// Nobody waits for the answer any more.
  void Cancelled();
  /// Ends a call whose request has not come, or has no place, with this error; others go on.
  void GiveWay(const absl::Status& status);
  /// Ends the call with DEADLINE_EXCEEDED (IDLE), or by cutting it, if at `now` it has waited for
  /// its client for too long. Gives the time before which there is no need to look again.
  std::chrono::steady_clock::time_point EndIfIdle(const UnaryLimits& limits,
                                                  std::chrono::steady_clock::time_point now);

  /// Becomes true when nobody waits for the answer any more.
  const std::atomic<bool>& cancelled() const { return cancelled_; }

 private:
  enum class Phase { kReading, kWorking, kWriting, kEnding, kAbandoned, kFinished };

  // What to do once the lock is released; the flags of what is going on are set already.
  struct Actions {
    bool read = false, answer = false, write = false, cut = false;
    std::uint64_t answer_bytes = 0;  // Of the request.
    std::optional<absl::Status> finish;
    std::uint64_t give_back = 0;  // Bytes.
  };

  // With the lock held:
  Actions Decide();
  void End(absl::Status status);
  void Abandon(absl::Status status);
  absl::Status TakeBytes(std::string field, std::uint64_t bytes);
  // Without:
  template <typename Event>
  void On(Event event);
  void Perform(Actions actions);
  void Answer(Worker* worker);

  UnaryTransport& transport_;
  MemoryBudget& budget_;
  ComputePool* const pool_;
  const std::shared_ptr<const CallerAccount> caller_;
  const UnaryKind kind_;
  std::atomic<bool> cancelled_ = false;

  mutable std::mutex mutex_;  // Guards everything below.
  Phase phase_ = Phase::kReading;
  absl::Status status_;
  bool working_ = false, writing_ = false;
  bool owes_read_ = false, owes_answer_ = false, owes_write_ = false, owes_cut_ = false;
  // Between the decision and the return of the transport's call: the transport has to stay.
  bool calling_ = false;
  std::uint64_t held_bytes_ = 0, surplus_ = 0;
  std::chrono::steady_clock::time_point phase_began_ = std::chrono::steady_clock::now();
};

}  // namespace partiemc::server
