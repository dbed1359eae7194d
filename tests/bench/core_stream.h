// A stream of frames through the core in this process, with the cost of each stage.
#pragma once

#include <benchmark/benchmark.h>
#include <oneapi/tbb/task_arena.h>

#include <array>
#include <cstdint>
#include <span>

#include "bench/clocks.h"
#include "bench/scenes.h"
#include "partiemc/reconstructor.h"
#include "partiemc/stage.h"

namespace partiemc::bench {

/// Sums the cost of each stage over frames.
class StageClock final : public StageObserver {
 public:
  void StageBegins(Stage) override { begin_ = Cost::Now(); }
  void StageEnds(Stage stage) override {
    costs_[static_cast<std::size_t>(stage)] += Cost::Now() - begin_;
  }
  void Clear() { costs_ = {}; }
  const Cost& operator[](Stage stage) const { return costs_[static_cast<std::size_t>(stage)]; }

 private:
  Cost begin_;
  std::array<Cost, kStageCount> costs_{};
};

/// Keeps state, workspace and result from frame to frame, as a stream of a server does.
class CoreStream {
 public:
  /// Requires: `scene` and `ids` outlive the stream; `ids` has an id for each particle, or is
  /// empty. Exits if the parameters are refused.
  CoreStream(const Scene& scene, const ReconstructionParameters& parameters,
             std::span<const std::uint64_t> ids = {});

  /// Reconstructs the scene's next frame in an arena of one or of two threads.
  void Next(int threads = 1);
  /// At the first call, plays the scene once and one frame more, so that all buffers have grown.
  void WarmUp();

  const Result& result() const { return result_; }
  const State& state() const { return state_; }
  StageClock& stages() { return stages_; }

 private:
  const Scene& scene_;
  std::span<const std::uint64_t> ids_;
  const Attribute phases_;  // Of the scene.
  Reconstructor reconstructor_;
  State state_;
  Workspace workspace_;
  Result result_;
  StageClock stages_;
  std::array<oneapi::tbb::task_arena, 2> arenas_;
  std::size_t next_ = 0;
  bool is_warm_ = false;
};

/// Measures warm frames. The counters "STAGE_wall_ms" and "STAGE_cpu_ms" are means over the frames;
/// "state_bytes" is the size of the serialised state.
void MeasureFrames(CoreStream& stream, benchmark::State& state, int threads = 1);

/// The reference parameters, all outputs: `kernel_radius` spacings, cell = spacing, greedy fill.
ReconstructionParameters ReferenceParameters(const Scene& scene, double kernel_radius = 3);

}  // namespace partiemc::bench
