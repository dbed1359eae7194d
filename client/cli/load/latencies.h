// Times of answers: what they are like, and whether they have settled.
#pragma once

#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

namespace partiemc::client {

/// In milliseconds, by nearest rank: p50 is the least time that half of the answers did not exceed.
struct Percentiles {
  std::size_t count = 0;
  double p50 = 0, p90 = 0, p99 = 0, max = 0;
};
/// All 0 of none. Sorts `times`.
Percentiles PercentilesOf(std::vector<double>& times);

/// Whether two windows of equal length tell the same: their medians and their 99th percentiles
/// differ by at most 5 %, or .2 ms. Of windows without answers, no.
bool HaveSettled(const Percentiles& before, const Percentiles& after);

/// Collects times from many threads.
class Latencies {
 public:
  void Add(double milliseconds) {
    const std::lock_guard lock(mutex_);
    times_.push_back(milliseconds);
  }
  /// What has come since the last call.
  std::vector<double> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(times_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<double> times_;
};

}  // namespace partiemc::client
