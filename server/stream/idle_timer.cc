#include "server/stream/idle_timer.h"

#include <algorithm>
#include <chrono>

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

// Returns the shortest limit, at most an hour. A call that begins now cannot exceed any limit
// before this time has passed.
milliseconds ShortestLimit(const ServerLimits& limits) {
  milliseconds shortest = std::chrono::hours(1);
  for (const milliseconds limit : {limits.idle.opening, limits.idle.streaming, limits.unary.request,
                                   limits.unary.answer, limits.paused.pause, limits.paused.write}) {
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
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  changed_.NotifyAll();
  thread_.join();
}

void IdleTimer::Look() {
  {
    const MutexLock lock(mutex_);
    look_ = true;
  }
  changed_.NotifyAll();
}

void IdleTimer::Run() {
  const MutexLock lock(mutex_);
  while (!stopping_) {
    const auto next = EndIdleCalls();
    while (!stopping_ && !look_ && changed_.WaitUntil(mutex_, next)) {
    }
    look_ = false;
  }
}

// Returns the time of the next check.
std::chrono::steady_clock::time_point IdleTimer::EndIdleCalls() {
  const MutexUnlock unlock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  return std::min({streams_.EndIdle(limits_.idle, now),
                   watchers_.EndSilent(limits_.idle.opening, now),
                   watchers_.EndPaused(limits_.paused, now), calls_.EndIdle(limits_.unary, now),
                   now + ShortestLimit(limits_)});
}

}  // namespace partiemc::server
