// What the running server counts, as Prometheus reads it.
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

/// Counters and histograms are kept as things happen, at some hundred nanoseconds a frame; gauges,
/// and counters of others, are asked for when somebody reads. No label has a value that a client
/// could choose, so that the number of series is bounded. Safe from any thread.
class Metrics final : public prometheus::Collectable, public FrameObserver {
 public:
  Metrics();

  void FrameReconstructed(std::uint64_t particles, const StageClock& clock) override;
  void FrameRefused(std::string_view reason) override;

  /// A gauge whose value is asked for at each reading. Before anybody reads.
  void AddGauge(std::string name, std::string help, std::function<double()> value);
  /// The same for what only grows.
  void AddCounter(std::string name, std::string help, std::function<double()> value);

  /// For counters of other parts.
  prometheus::Registry& registry() { return registry_; }

  /// Everything, the process's memory, processor time and file descriptors included.
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

/// Buckets for times from a tenth of a millisecond to ten seconds.
const std::vector<double>& SecondsBuckets();

}  // namespace partiemc::server
