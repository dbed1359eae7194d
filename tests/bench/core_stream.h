// A stream of frames through the core in this process, stage by stage on the clock.
#pragma once

#include <oneapi/tbb/task_arena.h>

#include <array>
#include <cstdint>
#include <span>

#include "bench/clocks.h"
#include "bench/scenes.h"
#include "partiemc/reconstructor.h"
#include "partiemc/stage.h"

namespace partiemc::bench {

/// Sums what each stage costs over frames.
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

/// State, workspace and result are kept from frame to frame, as a server's stream keeps them.
class CoreStream {
 public:
  /// `scene` must outlive the stream, and `ids`: of the scene's particles, or empty. Ends the
  /// program where the parameters are refused.
  CoreStream(const Scene& scene, const ReconstructionParameters& parameters,
             std::span<const std::uint64_t> ids = {});

  /// Reconstructs the scene's next frame in an arena of one or of two threads.
  void Next(int threads = 1);
  /// Plays the scene once and one frame more, so that buffers have seen every frame in its place.
  void WarmUp();

  const Result& result() const { return result_; }
  const State& state() const { return state_; }
  StageClock& stages() { return stages_; }

 private:
  const Scene& scene_;
  std::span<const std::uint64_t> ids_;
  Reconstructor reconstructor_;
  State state_;
  Workspace workspace_;
  Result result_;
  StageClock stages_;
  std::array<oneapi::tbb::task_arena, 2> arenas_;
  std::size_t next_ = 0;
};

/// The reference parameters, all outputs: `kernel_radius` spacings, cell = spacing, greedy fill.
ReconstructionParameters ReferenceParameters(const Scene& scene, double kernel_radius = 3);

}  // namespace partiemc::bench
