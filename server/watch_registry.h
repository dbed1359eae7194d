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
#include "server/watch_flow.h"

namespace partiemc::server {

inline constexpr std::string_view kReasonTooManyWatchers = "TOO_MANY_WATCHERS";

/// Safe from any thread.
class WatchRegistry {
 public:
  explicit WatchRegistry(std::uint32_t max_watchers) : max_watchers_(max_watchers) {}

  /// A watcher comes in, before it has said what it wants to watch. Errors, each with a Violation:
  /// UNAVAILABLE (DRAINING), RESOURCE_EXHAUSTED (TOO_MANY_WATCHERS).
  absl::Status Enter(std::shared_ptr<WatchFlow> watcher);
  /// Its last word has been sent.
  void Leave(const WatchFlow& watcher);

  std::size_t count() const;

  /// Lets nobody in any more and ends every watch. Those that cannot be told by `patience` are cut.
  void Drain(std::chrono::steady_clock::time_point patience);
  /// Whether all have left before the deadline.
  bool WaitUntilEmpty(std::chrono::steady_clock::time_point deadline);

 private:
  std::vector<std::shared_ptr<WatchFlow>> All() const;

  const std::uint32_t max_watchers_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable left_;
  std::map<const WatchFlow*, std::shared_ptr<WatchFlow>> watchers_;
  bool draining_ = false;
};

}  // namespace partiemc::server
