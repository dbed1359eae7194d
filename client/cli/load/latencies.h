// Percentiles of response times, and whether they have settled.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/mutex.h"

namespace partiemc::client {

/// In milliseconds, by nearest rank.
struct Percentiles {
  std::size_t count = 0;
  double p50 = 0, p90 = 0, p99 = 0, max = 0;
};
/// Returns 0 for every percentile if `times` is empty. Sorts `times`.
Percentiles PercentilesOf(std::vector<double>& times);

/// Whether two windows of equal length have similar latencies: both the medians and the 99th
/// percentiles differ by at most 5 % of the larger one, or by at most 0.2 ms. False if a window is
/// empty.
bool HaveSettled(const Percentiles& before, const Percentiles& after);

/// Collects times from many threads.
class Latencies {
 public:
  void Add(double milliseconds) ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    times_.push_back(milliseconds);
  }
  /// The times added since the last call.
  std::vector<double> Take() ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    return std::exchange(times_, {});
  }

 private:
  Mutex mutex_;
  std::vector<double> times_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::client
