// The watchers of this server: limits their number and drains them.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string_view>

#include "absl/status/status.h"
#include "common/mutex.h"
#include "server/base/call_registry.h"
#include "server/security/caller.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

inline constexpr std::string_view kReasonTooManyWatchers = "TOO_MANY_WATCHERS";

/// Thread-safe.
class WatchRegistry : private CallRegistry<WatchStateMachine, CallEntry<WatchStateMachine>> {
 public:
  explicit WatchRegistry(std::uint32_t max_watchers) : max_watchers_(max_watchers) {}

  /// Registers a watcher that has not sent its first request yet. OpeningCalls limits the number of
  /// such watchers.
  /// Errors, with a Violation: UNAVAILABLE (DRAINING).
  absl::Status Enter(std::shared_ptr<WatchStateMachine> watcher) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Takes a slot for a watcher whose first request has arrived.
  /// Errors, with a Violation: RESOURCE_EXHAUSTED (TOO_MANY_WATCHERS, CALLER_WATCHERS).
  absl::Status Open(const WatchStateMachine& watcher, const Caller& caller = {})
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Frees the slot of a watcher. Called just before the end of its call is sent.
  void Close(const WatchStateMachine& watcher) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Removes a watcher. Called after the end of its call was sent.
  void Leave(const WatchStateMachine& watcher) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Number of watchers with a slot.
  std::size_t count() const ABSL_LOCKS_EXCLUDED(mutex_);
  /// Bytes of the pending results of all watchers. A result that several watchers share is counted
  /// for each of them.
  std::uint64_t held_bytes() const ABSL_LOCKS_EXCLUDED(mutex_);

  /// Ends the watchers that have not sent their first request within `limit`. Returns the earliest
  /// time at which another watcher can reach the limit.
  std::chrono::steady_clock::time_point EndSilent(std::chrono::milliseconds limit,
                                                  std::chrono::steady_clock::time_point now);

  /// Ends the watchers whose stream has ended and whose clients exceed `limits` at `now`. Returns
  /// the earliest time at which another watcher can exceed a limit.
  std::chrono::steady_clock::time_point EndPaused(const PauseLimits& limits,
                                                  std::chrono::steady_clock::time_point now);

  /// Refuses new watchers and ends every watch. Blocks until all have left, at most until
  /// `patience`; then cuts the watches whose clients have not read the end.
  void Drain(std::chrono::steady_clock::time_point patience) ABSL_LOCKS_EXCLUDED(mutex_);
  using CallRegistry::WaitUntilEmpty;

 private:
  const std::uint32_t max_watchers_;
  // Watchers with a slot: from Open to Close.
  std::map<const WatchStateMachine*, CallerAccount::Place> placed_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
