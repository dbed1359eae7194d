#include "server/stream/idle_timer.h"

#include <algorithm>
#include <chrono>

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

// A call that begins now cannot exceed a limit before this time has passed.
milliseconds ShortestLimit(const ServerLimits& limits) {
  milliseconds shortest = std::chrono::hours(1);
  for (const milliseconds limit :
       {limits.idle.opening, limits.idle.streaming, limits.unary.request, limits.unary.answer}) {
    if (limit > milliseconds(0)) shortest = std::min(shortest, limit);
  }
  return shortest;
}

}  // namespace

IdleTimer::IdleTimer(StreamRegistry& streams, WatchRegistry& watchers, UnaryRegistry& calls,
                     const ServerLimits& limits)
    : streams_(streams), watchers_(watchers), calls_(calls), limits_(limits) {
  thread_ = std::thread([this] { Run(); });
  streams_.OnEarlierLook([this] { Look(); });
}

IdleTimer::~IdleTimer() {
  streams_.OnEarlierLook({});
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void IdleTimer::Look() {
  {
    const std::lock_guard lock(mutex_);
    look_ = true;
  }
  changed_.notify_all();
}

void IdleTimer::Run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    lock.unlock();
    const auto now = std::chrono::steady_clock::now();
    const auto next = std::min({streams_.EndIdle(limits_.idle, now),
                                watchers_.EndSilent(limits_.idle.opening, now),
                                calls_.EndIdle(limits_.unary, now), now + ShortestLimit(limits_)});
    lock.lock();
    changed_.wait_until(lock, next, [this] { return stopping_ || look_; });
    look_ = false;
  }
}

}  // namespace partiemc::server
