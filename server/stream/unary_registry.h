// The unary calls of this server: limits their number and drains them.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>

#include "absl/status/status.h"
#include "common/mutex.h"
#include "server/base/call_registry.h"
#include "server/compute/fair_share.h"
#include "server/security/caller.h"
#include "server/stream/unary_state_machine.h"

namespace partiemc::server {

/// The violation's reason if there are too many calls (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonTooManyCalls = "TOO_MANY_CALLS";

struct UnaryEntry : CallEntry<UnaryStateMachine> {
  UnaryKind kind = UnaryKind::kFrame;
  const CallerAccount* caller = nullptr;  ///< The caller charged for its slot; null: no slot.
};

/// Limits the number of concurrent calls of each kind. Thread-safe.
class UnaryRegistry : private CallRegistry<UnaryStateMachine, UnaryEntry> {
 public:
  /// Maximum number of one caller's calls for information, and of its health checks. Such calls
  /// take little time.
  static constexpr std::uint32_t kInformationCalls = 64;

  /// `max_frame_calls`: maximum number of calls with a frame of one caller. Each kind has twice
  /// this number of slots, because FairShare gives one caller at most half of them.
  explicit UnaryRegistry(std::uint32_t max_frame_calls)
      : places_{FairShare(2 * std::uint64_t{max_frame_calls}), FairShare(2 * kInformationCalls),
                FairShare(2 * kInformationCalls)} {}

  /// Registers a call that has not sent its request yet. OpeningCalls limits the number of such
  /// calls.
  /// Errors, each with a Violation: UNAVAILABLE (DRAINING), for calls with a frame only.
  absl::Status Enter(std::shared_ptr<UnaryStateMachine> call, UnaryKind kind)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Takes a slot after the call's request has arrived. The account outlives the slot.
  /// Errors, each with a Violation: RESOURCE_EXHAUSTED (TOO_MANY_CALLS).
  absl::Status TakePlace(const UnaryStateMachine& call, const CallerAccount& caller)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Frees the call's slot, if it has one. Called when the call's status is known.
  void GiveBackPlace(const UnaryStateMachine& call) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Removes the call. Called after its status was sent.
  void Leave(const UnaryStateMachine& call) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Number of calls of all kinds.
  std::size_t count() const ABSL_LOCKS_EXCLUDED(mutex_);

  /// Ends the calls whose clients exceed an idle limit at `now`. Returns the earliest time at which
  /// another call may exceed a limit.
  std::chrono::steady_clock::time_point EndIdle(const UnaryLimits& limits,
                                                std::chrono::steady_clock::time_point now);

  /// Refuses further calls with a frame. Ends the calls of all kinds that have sent no request.
  void Drain() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Blocks until all calls with a frame have left. Returns false if `deadline` passes first. Other
  /// kinds of calls may continue.
  bool WaitForFrames(std::chrono::steady_clock::time_point deadline) ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  void FreePlace(const UnaryStateMachine& call) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool HasFrames() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  std::array<FairShare, 3> places_ ABSL_GUARDED_BY(mutex_);  // By kind.
};

}  // namespace partiemc::server
