// The base of the registries of streams, watchers and unary calls: tracks calls until they leave.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "common/mutex.h"

namespace partiemc::server {

/// The registry's data of a call; registries derive from it. `Machine`: the call's state machine.
template <typename Machine>
struct CallEntry {
  std::shared_ptr<Machine> machine;
  std::uint64_t arrival = 0;  ///< Number of calls that were admitted before this one.
};

/// Tracks the calls from Add to Remove. `Data`: a CallEntry<Machine> with more members.
template <typename Machine, typename Data>
class CallRegistry {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  CallRegistry(const CallRegistry&) = delete;
  CallRegistry& operator=(const CallRegistry&) = delete;

  /// Blocks until all calls have left. Returns false if `deadline` passes first.
  bool WaitUntilEmpty(TimePoint deadline) ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    while (!entries_.empty() && left_.WaitUntil(mutex_, deadline)) {
    }
    return entries_.empty();
  }

 protected:
  using Entry = Data;

  CallRegistry() = default;
  ~CallRegistry() = default;

  Entry& Add(std::shared_ptr<Machine> machine) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    Entry& entry = entries_[machine.get()];
    entry.machine = std::move(machine);
    entry.arrival = arrived_++;
    return entry;
  }

  /// Removes a call, if it was admitted. Notifies while the lock is held, because a thread that
  /// waits may destroy the registry afterwards.
  void Remove(const Machine& machine) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    entries_.erase(&machine);
    left_.NotifyAll();
  }

  /// The calls in the order of arrival. Callers end them without the lock, because a call that ends
  /// may call Leave.
  std::vector<std::shared_ptr<Machine>> All() const ABSL_LOCKS_EXCLUDED(mutex_) {
    std::map<std::uint64_t, std::shared_ptr<Machine>> by_arrival;
    {
      const MutexLock lock(mutex_);
      for (const auto& [key, entry] : entries_) by_arrival[entry.arrival] = entry.machine;
    }
    std::vector<std::shared_ptr<Machine>> machines;
    machines.reserve(by_arrival.size());
    for (auto& [arrival, machine] : by_arrival) machines.push_back(std::move(machine));
    return machines;
  }

  /// Calls `end_if_late` with each call. `end_if_late` returns the earliest time at which this call
  /// may exceed a limit. EndLate returns the minimum of these times; TimePoint::max() if none.
  template <typename EndIfLate>
  TimePoint EndLate(const EndIfLate& end_if_late) ABSL_LOCKS_EXCLUDED(mutex_) {
    TimePoint look_again = TimePoint::max();
    for (const auto& machine : All()) look_again = std::min(look_again, end_if_late(*machine));
    return look_again;
  }

  void StopAdmitting() ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    draining_ = true;
  }

  mutable Mutex mutex_;
  CondVar left_;
  std::map<const Machine*, Entry> entries_ ABSL_GUARDED_BY(mutex_);
  bool draining_ ABSL_GUARDED_BY(mutex_) = false;

 private:
  std::uint64_t arrived_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace partiemc::server
