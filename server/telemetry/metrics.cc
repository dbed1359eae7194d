#include "server/telemetry/metrics.h"

#include <iterator>
#include <utility>

#include "common/stage_clock.h"
#include "server/telemetry/process_metrics.h"

namespace partiemc::server {
namespace {

using prometheus::MetricType;

prometheus::Counter& MakeCounter(prometheus::Registry& registry, const std::string& name,
                                 const std::string& help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add({});
}

}  // namespace

const std::vector<double>& SecondsBuckets() {
  static const std::vector<double> buckets = {0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005,
                                              0.01,   0.025,   0.05,   0.1,   0.25,   0.5,
                                              1,      2.5,     5,      10};
  return buckets;
}

Metrics::Metrics()
    : frames_(MakeCounter(registry_, "partiemc_frames_total", "Frames answered by a result.")),
      particles_(
          MakeCounter(registry_, "partiemc_particles_total", "Particles of frames_total frames.")),
      frame_errors_(prometheus::BuildCounter()
                        .Name("partiemc_frame_errors_total")
                        .Help("Frames refused, by the reason that their client was told.")
                        .Register(registry_)),
      frame_seconds_(prometheus::BuildHistogram()
                         .Name("partiemc_frame_seconds")
                         .Help("Wall time of reconstructing and encoding a frame.")
                         .Register(registry_)
                         .Add({}, SecondsBuckets())) {
  auto& stages = prometheus::BuildHistogram()
                     .Name("partiemc_stage_seconds")
                     .Help("Wall time of each stage of a frame.")
                     .Register(registry_);
  for (std::size_t k = 0; k < kStageCount; ++k) {
    stage_seconds_[k] =
        &stages.Add({{"stage", std::string(Name(static_cast<Stage>(k)))}}, SecondsBuckets());
  }
  prometheus::BuildGauge()
      .Name("partiemc_build_info")
      .Help("Always 1; its label tells the version.")
      .Register(registry_)
      .Add({{"version", PARTIEMC_VERSION}})
      .Set(1);
}

void Metrics::FrameReconstructed(std::uint64_t particles, const StageClock& clock) {
  frames_.Increment();
  particles_.Increment(static_cast<double>(particles));
  frame_seconds_.Observe(clock.TotalMs() / 1000);
  for (std::size_t k = 0; k < kStageCount; ++k) {
    stage_seconds_[k]->Observe(clock.stages_ms()[k] / 1000);
  }
}

void Metrics::FrameRefused(std::string_view reason) {
  frame_errors_.Add({{"reason", std::string(reason)}}).Increment();
}

void Metrics::AddGauge(std::string name, std::string help, std::function<double()> value) {
  asked_.push_back({std::move(name), std::move(help), MetricType::Gauge, std::move(value)});
}

void Metrics::AddCounter(std::string name, std::string help, std::function<double()> value) {
  asked_.push_back({std::move(name), std::move(help), MetricType::Counter, std::move(value)});
}

std::vector<prometheus::MetricFamily> Metrics::Collect() const {
  std::vector<prometheus::MetricFamily> families = registry_.Collect();
  for (const Asked& asked : asked_) {
    families.push_back({asked.name, asked.help, asked.type, {}});
    prometheus::ClientMetric& metric = families.back().metric.emplace_back();
    (asked.type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = asked.value();
  }
  std::ranges::move(ProcessFamilies(), std::back_inserter(families));
  return families;
}

}  // namespace partiemc::server
