// The metrics of the server, for Prometheus.
#pragma once

#include <prometheus/collectable.h>
#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/histogram.h>
#include <prometheus/metric_family.h>
#include <prometheus/registry.h>

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "partiemc/stage.h"
#include "server/telemetry/frame_observer.h"

namespace partiemc::server {

/// Events update counters and histograms; this costs some hundred nanoseconds per frame. Each
/// scrape calls the functions of gauges and of external counters. No label has a value that a
/// client can choose, so the number of time series is bounded. Thread-safe.
class Metrics final : public prometheus::Collectable, public FrameObserver {
 public:
  Metrics();

  void FrameReconstructed(std::uint64_t particles, const StageClock& clock) override;
  void FrameRefused(std::string_view reason) override;

  /// Adds a gauge; each scrape calls `value`. Requires: no scrape has begun.
  void AddGauge(std::string name, std::string help, std::function<double()> value);
  /// Same as AddGauge, for a counter.
  void AddCounter(std::string name, std::string help, std::function<double()> value);

  /// The registry to which other components add their counters.
  prometheus::Registry& registry() { return registry_; }

  /// Returns all metrics, including memory, processor time and file descriptors of the process.
  std::vector<prometheus::MetricFamily> Collect() const override;

 private:
  struct Asked {
    std::string name, help;
    prometheus::MetricType type;
    std::function<double()> value;
  };

  prometheus::Registry registry_;
  prometheus::Counter& frames_;
  prometheus::Counter& particles_;
  prometheus::Family<prometheus::Counter>& frame_errors_;
  prometheus::Histogram& frame_seconds_;
  std::array<prometheus::Histogram*, kStageCount> stage_seconds_{};
  std::vector<Asked> asked_;
};

/// Histogram buckets for times from a tenth of a millisecond to ten seconds.
const std::vector<double>& SecondsBuckets();

}  // namespace partiemc::server
