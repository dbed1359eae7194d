// Decides when a unary call (one request, one response) reads, computes and writes. Independent of
// the messages and of the transport.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/mutex.h"
#include "server/base/serialized_call.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// The kinds of unary calls: kFrame computes a frame, kInformation returns information, kProbe is a
/// health check. Each kind has separate slots, so calls with frames never block the other two
/// kinds. Calls of these two kinds are small and get memory even if the budget is exhausted.
enum class UnaryKind { kFrame, kInformation, kProbe };

/// Carries the request and the response. UnaryStateMachine calls it without a lock.
class UnaryTransport {
 public:
  virtual ~UnaryTransport() = default;

  /// Starts to read the request; completes by UnaryStateMachine::ReadDone or ReadEnded.
  virtual void StartRead() = 0;
  /// Computes the response to the request and returns its size in bytes. An error ends the call.
  /// `worker` is null if the state machine has no pool.
  virtual absl::StatusOr<std::uint64_t> Answer(Worker* worker) = 0;
  /// Starts to write the response; completes by UnaryStateMachine::WriteDone.
  virtual void StartWrite() = 0;
  /// Makes the pending read and write fail soon.
  virtual void Cut() = 0;
  /// Ends the call with `status`. This is the last call to the transport; at most a read may still
  /// be in progress.
  virtual void Finish(const absl::Status& status) = 0;
};

/// Time for which a client may keep a call waiting; 0: no limit.
struct UnaryLimits {
  std::chrono::milliseconds request{0};  ///< From the start of the call to its request.
  std::chrono::milliseconds answer{0};   ///< From the start to the end of the response's write.
};

/// The state machine of one call (phases: server/base/call_state.h):
///
///   opening --request--> serving: computes, then writes --> ending --> finished
///      |                    |                                             ^
///      +--------------------+------- cancelled, cut -------> abandoned ---+
///      +-- refused, no request, drained: ending
///
/// Memory: the budget of all streams counts the request after it was read, and the response until
/// it was written. If one does not fit into the budget, a call of kind kFrame ends. Thread-safe.
class UnaryStateMachine final : public SerializedCall {
 public:
  /// Requires: `transport` lives until its Finish returns; `budget`, `pool` and `caller` live
  /// longer. If `pool` is null, the thread that delivers the request computes the response. Memory
  /// and computing time are charged to `caller`.
  UnaryStateMachine(UnaryTransport& transport, MemoryBudget& budget, ComputePool* pool,
                    std::shared_ptr<const CallerAccount> caller = nullptr,
                    UnaryKind kind = UnaryKind::kFrame);

  /// Starts the read, or ends at once if `admission` is an error. Called once.
  void Start(absl::Status admission);

  void ReadDone(std::uint64_t bytes);
  /// No request will come.
  void ReadEnded();
  void WriteDone(bool ok);
  /// The client has disconnected.
  void Cancelled();
  /// Ends this call with this error if ReadDone was not called yet. Otherwise has no effect.
  void GiveWay(const absl::Status& status);
  /// Ends the call if its client has exceeded a limit at `now`: with DEADLINE_EXCEEDED (IDLE), or
  /// by cutting the call if the response is being written. Returns the time of the next check.
  std::chrono::steady_clock::time_point EndIfIdle(const UnaryLimits& limits,
                                                  std::chrono::steady_clock::time_point now);

  /// Becomes true when the response can no longer be delivered.
  const std::atomic<bool>& cancelled() const { return cancelled_; }

  std::shared_ptr<UnaryStateMachine> shared_from_this() {
    return std::static_pointer_cast<UnaryStateMachine>(SerializedCall::shared_from_this());
  }

 private:
  void Decide() override ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void End(absl::Status status, Phase phase = Phase::kEnding) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status TakeBytes(std::string field, std::uint64_t bytes)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Actions:
  void StartAnswer(std::uint64_t bytes);
  void Answer(Worker* worker) ABSL_LOCKS_EXCLUDED(mutex_);
  void ReturnMemory() ABSL_LOCKS_EXCLUDED(mutex_);

  UnaryTransport& transport_;
  MemoryBudget& budget_;
  ComputePool* const pool_;
  const std::shared_ptr<const CallerAccount> caller_;
  const UnaryKind kind_;
  std::atomic<bool> cancelled_ = false;

  absl::Status status_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t held_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  // Time at which the read began; later, the time at which the write began.
  std::chrono::steady_clock::time_point began_ ABSL_GUARDED_BY(mutex_) =
      std::chrono::steady_clock::now();
};

}  // namespace partiemc::server
