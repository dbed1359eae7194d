#include "bench/harness.h"

#include <utility>

#include "bench/progress.h"
#include "bench/statistics.h"

namespace partiemc::bench {

// Keeps every repetition and prints nothing.
class Harness::Collector final : public benchmark::BenchmarkReporter {
 public:
  explicit Collector(Harness& harness) : harness_(harness) {}
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type == Run::RT_Iteration) {
        harness_.runs_[run.run_name.function_name].push_back(run);
      }
    }
  }

 private:
  Harness& harness_;
};

void Harness::Add(const std::string& name, int iterations, Body body) {
  planned_ += repetitions_;
  benchmark::RegisterBenchmark(name.c_str(),
                               [this, name, body = std::move(body)](benchmark::State& state) {
                                 Progress("in process, " + std::to_string(++started_) + " of " +
                                          std::to_string(planned_) + ": " + name);
                                 body(state);
                               })
      ->Iterations(iterations)
      ->Repetitions(repetitions_)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

void Harness::Run() {
  std::string program = "bench", interleave = "--benchmark_enable_random_interleaving=true";
  char* arguments[] = {program.data(), interleave.data()};
  int count = 2;
  benchmark::Initialize(&count, arguments);
  Collector collector(*this);
  benchmark::RunSpecifiedBenchmarks(&collector);
  benchmark::ClearRegisteredBenchmarks();
}

Cost Harness::Median(const std::string& name) const {
  std::vector<double> wall, cpu;
  for (const auto& run : runs_.at(name)) {
    const auto iterations = static_cast<double>(run.iterations);
    wall.push_back(1e3 * run.real_accumulated_time / iterations);
    cpu.push_back(1e3 * run.cpu_accumulated_time / iterations);
  }
  return {bench::Median(wall), bench::Median(cpu)};
}

double Harness::MedianCounter(const std::string& name, const std::string& counter) const {
  std::vector<double> values;
  for (const auto& run : runs_.at(name)) values.push_back(run.counters.at(counter));
  return bench::Median(values);
}

}  // namespace partiemc::bench
