// Runs a stage of a frame and reports it.
#pragma once

#include "base/cancellation.h"
#include "partiemc/stage.h"

namespace partiemc {

/// Returns run(), after StageBegins and before StageEnds of `observer`, which may be null. If the
/// frame is cancelled, throws Cancelled and calls none of them.
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
