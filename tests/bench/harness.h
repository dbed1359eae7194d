// Google Benchmark as the harness of everything that is measured in this process: measures are
// added one by one and run together, repetitions of all of them in random order, so that a slow
// minute of the machine falls on all of them alike and their ratios hold.
#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/clocks.h"

namespace partiemc::bench {

class Harness {
 public:
  /// The body runs its loop over the state; counters that it sets are averaged over iterations.
  using Body = std::function<void(benchmark::State&)>;

  explicit Harness(int repetitions) : repetitions_(repetitions) {}

  /// `iterations` calls are one repetition. Names are unique within the process.
  void Add(const std::string& name, int iterations, Body body);

  /// Runs what was added since the last call.
  void Run();

  /// Medians over the repetitions, per iteration. Requires: Run, and a measure of that name.
  Cost Median(const std::string& name) const;
  double MedianCounter(const std::string& name, const std::string& counter) const;

  int repetitions() const { return repetitions_; }

 private:
  class Collector;

  int repetitions_;
  std::map<std::string, std::vector<benchmark::BenchmarkReporter::Run>> runs_;
  int started_ = 0, planned_ = 0;  // Repetitions, for the progress line.
};

}  // namespace partiemc::bench
