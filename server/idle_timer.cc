#include "server/idle_timer.h"

#include <algorithm>
#include <chrono>

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

// For as long one that comes only now cannot have waited for too long.
milliseconds ShortestLimit(const IdleLimits& limits) {
  if (limits.opening <= milliseconds(0)) return limits.streaming;
  if (limits.streaming <= milliseconds(0)) return limits.opening;
  return std::min(limits.opening, limits.streaming);
}

}  // namespace

IdleTimer::IdleTimer(StreamRegistry& streams, WatchRegistry& watchers, const IdleLimits& limits)
    : streams_(streams), watchers_(watchers), limits_(limits) {
  if (ShortestLimit(limits) > milliseconds(0)) thread_ = std::thread([this] { Run(); });
}

IdleTimer::~IdleTimer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_came_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void IdleTimer::Run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    lock.unlock();
    const auto now = std::chrono::steady_clock::now();
    const auto next =
        std::min({streams_.EndIdle(limits_, now), watchers_.EndSilent(limits_.opening, now),
                  now + ShortestLimit(limits_)});
    lock.lock();
    stop_came_.wait_until(lock, next, [this] { return stopping_; });
  }
}

}  // namespace partiemc::server
