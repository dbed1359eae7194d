// The thread that ends idle calls.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/stream/unary_registry.h"
#include "server/watch/watch_registry.h"

namespace partiemc::server {

/// Ends streams, watchers and unary calls that exceed their idle limits. Its thread sleeps until
/// the earliest deadline of a call.
class IdleTimer {
 public:
  /// The registries outlive the timer.
  IdleTimer(StreamRegistry& streams, WatchRegistry& watchers, UnaryRegistry& calls,
            const ServerLimits& limits);
  ~IdleTimer();
  IdleTimer(const IdleTimer&) = delete;
  IdleTimer& operator=(const IdleTimer&) = delete;

 private:
  void Run();
  void Look();

  StreamRegistry& streams_;
  WatchRegistry& watchers_;
  UnaryRegistry& calls_;
  const ServerLimits limits_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false, look_ = false;  // Guarded by mutex_.
  std::thread thread_;
};

}  // namespace partiemc::server
