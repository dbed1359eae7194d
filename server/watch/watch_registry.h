// The watchers of this server: how many may come in, and how all are sent home.
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

/// Safe from any thread.
class WatchRegistry {
 public:
  explicit WatchRegistry(std::uint32_t max_watchers) : max_watchers_(max_watchers) {}

  /// A watcher comes in, before it has said what it wants to watch: those are counted elsewhere
  /// (OpeningCalls). Errors, with a Violation: UNAVAILABLE (DRAINING).
  absl::Status Enter(std::shared_ptr<WatchStateMachine> watcher);
  /// It has said so, and gets a place. Errors, each with a Violation: RESOURCE_EXHAUSTED
  /// (TOO_MANY_WATCHERS, CALLER_WATCHERS).
  absl::Status Open(const WatchStateMachine& watcher, const Caller& caller = {});
  /// Its last word is about to be sent: its place is free.
  void Close(const WatchStateMachine& watcher);
  /// Its last word has been sent.
  void Leave(const WatchStateMachine& watcher);

  /// Of those that have a place.
  std::size_t count() const;
  /// Of results that watchers have not taken yet, counted for each although they share them.
  std::uint64_t held_bytes() const;

  /// Ends those that have not said for `limit` what they want to watch. Gives the time before which
  /// none of those that are here now will have.
  std::chrono::steady_clock::time_point EndSilent(std::chrono::milliseconds limit,
                                                  std::chrono::steady_clock::time_point now);

  /// Lets nobody in any more and ends every watch. Those that cannot be told by `patience` are cut.
  void Drain(std::chrono::steady_clock::time_point patience);
  /// Whether all have left before the deadline.
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
