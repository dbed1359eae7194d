#include <benchmark/benchmark.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "bench/allocations.h"
#include "bench/core_stream.h"
#include "bench/measures.h"
#include "bench/scatter_floor.h"
#include "support/random.h"

namespace partiemc::bench {
namespace {

// A repetition takes at least some ten milliseconds and plays every frame of the scene once.
int IterationsOf(const Scene& scene) {
  const auto particles = static_cast<int>(scene.ParticleCount());
  return std::max(500'000 / particles, static_cast<int>(scene.frames.size()));
}

// Two streams of the same frames, one with ids.
struct Streams {
  Streams(const Scene& scene, double kernel_radius)
      : ids(ShuffledIds(scene)),
        plain(scene, ReferenceParameters(scene, kernel_radius)),
        with_ids(scene, ReferenceParameters(scene, kernel_radius), ids) {}

  std::vector<std::uint64_t> ids;
  CoreStream plain, with_ids;
};

void RegisterFrames(const Scene& scene, const std::string& name, double kernel_radius,
                    bool two_threads) {
  const int iterations = IterationsOf(scene);
  const auto streams = std::make_shared<Streams>(scene, kernel_radius);
  Register("frame/" + name, iterations,
           [streams](benchmark::State& state) { MeasureFrames(streams->plain, state); });
  Register("frame_with_ids/" + name, iterations,
           [streams](benchmark::State& state) { MeasureFrames(streams->with_ids, state); });
  if (!two_threads) return;
  Register("frame_two_threads/" + name, iterations,
           [streams](benchmark::State& state) { MeasureFrames(streams->plain, state, 2); });
}

void RegisterFloor(const Scene& scene, const std::string& name, int kernel_radius) {
  const auto buffers = std::make_shared<ScatterBuffers>();
  const auto xy = FloatPositions(scene);
  const LatticeBox box = LatticeBox::Around(xy, kernel_radius + 1);
  Register("floor/" + name, IterationsOf(scene), [=](benchmark::State& state) {
    for (auto _ : state) ScatterDensity(xy, box, kernel_radius, *buffers);
  });
}

// The speed-up of two threads on work that shares nothing and touches no memory is the largest
// that the machine allows at the moment.
void RegisterSpin(int threads) {
  const auto arena = std::make_shared<tbb::task_arena>(threads);
  Register(absl::StrCat("spin/", threads), 2, [arena](benchmark::State& state) {
    constexpr int kPieces = 64;
    constexpr std::uint64_t kSteps = 1'000'000;
    for (auto _ : state) {
      arena->execute([] {
        tbb::parallel_for(0, kPieces, [](int piece) {
          support::Random random(piece);
          for (std::uint64_t k = 0; k < kSteps; ++k) benchmark::DoNotOptimize(random.Bits());
        });
      });
    }
  });
}

void RegisterAllocations(const Scene& scene) {
  const auto stream = std::make_shared<CoreStream>(scene, ReferenceParameters(scene));
  constexpr int kFrames = 40;
  Register("allocations/" + scene.name, kFrames, [stream](benchmark::State& state) {
    for (int k = 0; k < kFrames; ++k) stream->Next(2);  // Warms up both threads.
    StartCountingAllocations();
    for (auto _ : state) stream->Next(2);
    const Allocations counted = StopCountingAllocations();
    const auto a_frame = [](std::uint64_t count) {
      return benchmark::Counter(static_cast<double>(count), benchmark::Counter::kAvgIterations);
    };
    state.counters["calls"] = a_frame(counted.calls);
    state.counters["bytes"] = a_frame(counted.bytes);
    state.counters["tbb_calls"] = a_frame(counted.tbb_calls);
  });
}

}  // namespace

void RegisterCore(const Scenes& scenes) {
  for (const Scene& blob : scenes.blobs) {
    RegisterFrames(blob, blob.name, 3, true);
    RegisterFloor(blob, blob.name, 3);
    if (blob.name == "4m") continue;
    RegisterFrames(blob, blob.name + "_r2", 2, false);
    RegisterFloor(blob, blob.name + "_r2", 2);
  }
  RegisterFrames(scenes.islands_1m, "islands_1m", 3, false);
  RegisterFrames(scenes.dam_break, "dam_break", 3, false);
  RegisterFrames(scenes.load_1m, "load_1m", 3, false);
  for (const Scene& blob : scenes.blobs) {
    if (blob.name == "100k") RegisterAllocations(blob);
  }
  for (const int threads : {1, 2}) RegisterSpin(threads);
}

}  // namespace partiemc::bench
