// Runs a stage of a frame and reports it.
#pragma once

#include "base/cancellation.h"
#include "partiemc/stage.h"

namespace partiemc {

/// Runs a stage between its reports to `observer`, which may be null. Throws Cancelled instead if
/// the frame is cancelled.
template <typename Run>
auto InStage(StageObserver* observer, Stage stage, Run run) {
  ThrowIfCancelled();
  struct Scope {
    StageObserver* observer;
    Stage stage;
    ~Scope() {
      if (observer != nullptr) observer->StageEnds(stage);
    }
  };
  if (observer != nullptr) observer->StageBegins(stage);
  const Scope scope{observer, stage};
  return run();
}

}  // namespace partiemc
