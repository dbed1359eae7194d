#include "bench/core_stream.h"

#include "bench/progress.h"

namespace partiemc::bench {

CoreStream::CoreStream(const Scene& scene, const ReconstructionParameters& parameters)
    : scene_(scene),
      reconstructor_(Require(Reconstructor::Create(parameters))),
      arenas_{oneapi::tbb::task_arena(1), oneapi::tbb::task_arena(2)} {}

void CoreStream::Next(int threads) {
  const Frame frame = scene_.At(next_++);
  Require(arenas_[threads - 1].execute(
      [&] { return reconstructor_.Reconstruct(frame, state_, workspace_, result_, &stages_); }));
}

void CoreStream::WarmUp() {
  for (std::size_t k = 0; k <= scene_.frames.size(); ++k) Next();
}

ReconstructionParameters ReferenceParameters(const Scene& scene, double kernel_radius) {
  return {.fill = Fill::kGreedy, .spacing = scene.spacing, .kernel_radius = kernel_radius};
}

}  // namespace partiemc::bench
