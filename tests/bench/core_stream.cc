#include "bench/core_stream.h"

#include "bench/progress.h"

namespace partiemc::bench {

CoreStream::CoreStream(const Scene& scene, const ReconstructionParameters& parameters,
                       std::span<const std::uint64_t> ids)
    : scene_(scene),
      ids_(ids),
      reconstructor_(Require(Reconstructor::Create(parameters))),
      arenas_{oneapi::tbb::task_arena(1), oneapi::tbb::task_arena(2)} {}

void CoreStream::Next(int threads) {
  Frame frame = scene_.At(next_++);
  if (!ids_.empty()) frame.ids = ids_.first(frame.ParticleCount());
  Require(arenas_[threads - 1].execute([&] {
    return reconstructor_.Reconstruct(frame, state_, workspace_, result_, {.observer = &stages_});
  }));
}

void CoreStream::WarmUp() {
  for (std::size_t k = 0; k <= scene_.frames.size(); ++k) Next();
}

ReconstructionParameters ReferenceParameters(const Scene& scene, double kernel_radius) {
  return {.fill = Fill::kGreedy, .spacing = scene.spacing, .kernel_radius = kernel_radius};
}

}  // namespace partiemc::bench
