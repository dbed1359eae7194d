// The thread that ends idle calls.
#pragma once

#include <thread>

#include "common/mutex.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/stream/unary_registry.h"
#include "server/watch/watch_registry.h"

namespace partiemc::server {

/// Ends streams, watchers and unary calls whose clients exceed their idle limits. The timer's
/// thread sleeps until the earliest deadline of a call.
class IdleTimer {
 public:
  /// The registries outlive the timer.
  IdleTimer(StreamRegistry& streams, WatchRegistry& watchers, UnaryRegistry& calls,
            const ServerLimits& limits);
  ~IdleTimer();
  IdleTimer(const IdleTimer&) = delete;
  IdleTimer& operator=(const IdleTimer&) = delete;

 private:
  void Run() ABSL_LOCKS_EXCLUDED(mutex_);
  std::chrono::steady_clock::time_point EndIdleCalls() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Look() ABSL_LOCKS_EXCLUDED(mutex_);

  StreamRegistry& streams_;
  WatchRegistry& watchers_;
  UnaryRegistry& calls_;
  const ServerLimits limits_;
  Mutex mutex_;
  CondVar changed_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  bool look_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace partiemc::server
