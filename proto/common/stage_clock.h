// The wall-clock time of the stages of a frame, for responses.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

#include "partiemc/reconstructor.h"
#include "partiemc/stage.h"

namespace partiemc {

/// Measures the stages of one frame, because the core reads no clock.
class StageClock final : public StageObserver {
 public:
  /// Wall-clock milliseconds of all runs of each stage; 0 for a stage that did not run.
  const std::array<double, kStageCount>& stages_ms() const { return stages_ms_; }
  /// Milliseconds since the construction of this object.
  double TotalMs() const { return MillisecondsSince(start_); }

  void StageBegins(Stage) override { stage_start_ = Clock::now(); }
  void StageEnds(Stage stage) override {
    stages_ms_[static_cast<std::size_t>(stage)] += MillisecondsSince(stage_start_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double MillisecondsSince(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  }

  Clock::time_point start_ = Clock::now();
  Clock::time_point stage_start_;
  std::array<double, kStageCount> stages_ms_{};
};

}  // namespace partiemc
