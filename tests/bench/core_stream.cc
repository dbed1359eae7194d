#include "bench/core_stream.h"

#include <string>
#include <utility>

#include "bench/require.h"
#include "partiemc/state.h"

namespace partiemc::bench {

CoreStream::CoreStream(const Scene& scene, const ReconstructionParameters& parameters,
                       std::span<const std::uint64_t> ids)
    : scene_(scene),
      ids_(ids),
      phases_{.name = "phase", .values = scene.phases},
      reconstructor_(Require(Reconstructor::Create(parameters))),
      arenas_{oneapi::tbb::task_arena(1), oneapi::tbb::task_arena(2)} {}

void CoreStream::Next(int threads) {
  Frame frame = scene_.At(next_++);
  if (!ids_.empty()) frame.ids = ids_.first(frame.ParticleCount());
  if (!phases_.values.empty()) frame.attributes = std::span(&phases_, 1);
  Require(arenas_[threads - 1].execute([&] {
    return reconstructor_.Reconstruct(frame, state_, workspace_, result_, {.observer = &stages_});
  }));
}

void CoreStream::WarmUp() {
  if (std::exchange(is_warm_, true)) return;
  for (std::size_t k = 0; k <= scene_.frames.size(); ++k) Next();
}

void MeasureFrames(CoreStream& stream, benchmark::State& state, int threads) {
  stream.WarmUp();
  stream.stages().Clear();
  for (auto _ : state) stream.Next(threads);
  for (std::size_t k = 0; k < kStageCount; ++k) {
    const auto stage = static_cast<Stage>(k);
    const Cost cost = stream.stages()[stage];
    const std::string name(Name(stage));
    state.counters[name + "_wall_ms"] = {cost.wall_ms, benchmark::Counter::kAvgIterations};
    state.counters[name + "_cpu_ms"] = {cost.cpu_ms, benchmark::Counter::kAvgIterations};
  }
  state.counters["state_bytes"] = static_cast<double>(SerializedBytes(stream.state()));
}

ReconstructionParameters ReferenceParameters(const Scene& scene, double kernel_radius) {
  return {.fill = Fill::kGreedy, .spacing = scene.spacing, .kernel_radius = kernel_radius};
}

}  // namespace partiemc::bench
