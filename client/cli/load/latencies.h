// Percentiles of response times, and whether they have settled.
#pragma once

#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

namespace partiemc::client {

/// In milliseconds, by nearest rank.
struct Percentiles {
  std::size_t count = 0;
  double p50 = 0, p90 = 0, p99 = 0, max = 0;
};
/// All 0 if `times` is empty. Sorts `times`.
Percentiles PercentilesOf(std::vector<double>& times);

/// Whether medians and 99th percentiles of two windows of equal length differ by at most 5 % or
/// .2 ms. False if a window is empty.
bool HaveSettled(const Percentiles& before, const Percentiles& after);

/// Collects times from many threads.
class Latencies {
 public:
  void Add(double milliseconds) {
    const std::lock_guard lock(mutex_);
    times_.push_back(milliseconds);
  }
  /// The times added since the last call.
  std::vector<double> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(times_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<double> times_;
};

}  // namespace partiemc::client
