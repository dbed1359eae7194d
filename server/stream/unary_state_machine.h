// When a call of one request and one response reads, computes and writes. It knows neither the
// messages nor how they travel.
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

/// Each kind has its own slots, so that frames never keep out information or a probe. Calls of the
/// last two kinds are small and take their memory even if the budget is exhausted.
enum class UnaryKind { kFrame, kInformation, kProbe };

/// Carries the request and the response. UnaryStateMachine calls it without a lock.
class UnaryTransport {
 public:
  virtual ~UnaryTransport() = default;

  /// Starts to read the request; completes by UnaryStateMachine::ReadDone or ReadEnded.
  virtual void StartRead() = 0;
  /// Turns the request into the response and returns its size. An error ends the call. `worker` is
  /// null if the machine has no pool.
  virtual absl::StatusOr<std::uint64_t> Answer(Worker* worker) = 0;
  /// Starts to write the response; completes by UnaryStateMachine::WriteDone.
  virtual void StartWrite() = 0;
  /// Makes the pending read and write fail soon.
  virtual void Cut() = 0;
  /// The last call to the transport; only a read may still be in progress.
  virtual void Finish(const absl::Status& status) = 0;
};

/// How long a client may keep a call waiting; 0: no limit.
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
/// Memory: the request counts against the budget of all streams once it was read, its response
/// until it was written. If the budget has no room for one of them, the call ends. Thread-safe.
class UnaryStateMachine final : public SerializedCall {
 public:
  /// Requires: `transport` lives until its Finish returns, the others longer. Without a pool the
  /// thread that brings the request computes. Memory and computing count for `caller`.
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
  /// Ends a call without a request, or without a slot, with this error; other calls go on.
  void GiveWay(const absl::Status& status);
  /// Ends the call with DEADLINE_EXCEEDED (IDLE), or by cutting it, if at `now` its client has
  /// exceeded a limit. Returns the time of the next check.
  std::chrono::steady_clock::time_point EndIfIdle(const UnaryLimits& limits,
                                                  std::chrono::steady_clock::time_point now);

  /// Becomes true when the response cannot be delivered any more.
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
  // Start of the read, then of the write.
  std::chrono::steady_clock::time_point began_ ABSL_GUARDED_BY(mutex_) =
      std::chrono::steady_clock::now();
};

}  // namespace partiemc::server
