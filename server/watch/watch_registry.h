// The watchers of this server: their limit and their drain.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "server/security/caller.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

inline constexpr std::string_view kReasonTooManyWatchers = "TOO_MANY_WATCHERS";

/// Thread-safe.
class WatchRegistry {
 public:
  explicit WatchRegistry(std::uint32_t max_watchers) : max_watchers_(max_watchers) {}

  /// Registers a watcher before its first request; OpeningCalls counts those. Errors, with a
  /// Violation: UNAVAILABLE (DRAINING).
  absl::Status Enter(std::shared_ptr<WatchStateMachine> watcher);
  /// Takes a slot for a watcher after its first request. Errors, with a Violation:
  /// RESOURCE_EXHAUSTED (TOO_MANY_WATCHERS, CALLER_WATCHERS).
  absl::Status Open(const WatchStateMachine& watcher, const Caller& caller = {});
  /// Frees the slot of a watcher whose end is about to be sent.
  void Close(const WatchStateMachine& watcher);
  /// Removes a watcher whose end has been sent.
  void Leave(const WatchStateMachine& watcher);

  /// Number of watchers with a slot.
  std::size_t count() const;
  /// Bytes of pending results, counted per watcher although watchers share them.
  std::uint64_t held_bytes() const;

  /// Ends watchers without a first request for `limit`. Returns the earliest time at which another
  /// one can reach the limit.
  std::chrono::steady_clock::time_point EndSilent(std::chrono::milliseconds limit,
                                                  std::chrono::steady_clock::time_point now);

  /// Refuses new watchers and ends every watch. Cuts watches that do not accept their end by
  /// `patience`.
  void Drain(std::chrono::steady_clock::time_point patience);
  /// Waits until all watchers have left. Returns false at the deadline.
  bool WaitUntilEmpty(std::chrono::steady_clock::time_point deadline);

 private:
  std::vector<std::shared_ptr<WatchStateMachine>> All() const;

  const std::uint32_t max_watchers_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable left_;
  std::map<const WatchStateMachine*, std::shared_ptr<WatchStateMachine>> watchers_;
  std::map<const WatchStateMachine*, CallerAccount::Place> placed_;  // Open, not closed.
  bool draining_ = false;
};

}  // namespace partiemc::server
