// The one thread that ends streams whose clients keep them waiting.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

#include "server/stream_registry.h"

namespace partiemc::server {

/// Sleeps until the first stream may have waited for too long. No thread where nothing is limited.
class IdleTimer {
 public:
  /// `registry` lives longer.
  IdleTimer(StreamRegistry& registry, const IdleLimits& limits);
  ~IdleTimer();
  IdleTimer(const IdleTimer&) = delete;
  IdleTimer& operator=(const IdleTimer&) = delete;

 private:
  void Run();

  StreamRegistry& registry_;
  const IdleLimits limits_;
  std::mutex mutex_;
  std::condition_variable stop_came_;
  bool stopping_ = false;  // Guarded by mutex_.
  std::thread thread_;
};

}  // namespace partiemc::server
