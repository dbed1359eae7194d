// The time that the stages of a frame take, as answers tell it.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

#include "partiemc/reconstructor.h"
#include "partiemc/stage.h"

namespace partiemc {

/// Reads the clock for the core, which has none.
class StageClock final : public StageObserver {
 public:
  /// Wall time of each stage in milliseconds; 0 for one that did not run.
  const std::array<double, kStageCount>& stages_ms() const { return stages_ms_; }
  /// Since the clock was made.
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
