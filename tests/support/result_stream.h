// A stream of frames with its state and its last result.
#pragma once

#include <gtest/gtest.h>

#include "partiemc/reconstructor.h"
#include "support/particles.h"

namespace partiemc::support {

struct ResultStream {
  explicit ResultStream(const ReconstructionParameters& parameters)
      : reconstructor(*Reconstructor::Create(parameters)) {}

  /// Fails the test if the frame is refused.
  const Result& Next(const Frame& frame) {
    const absl::Status status = Try(frame);
    EXPECT_TRUE(status.ok()) << status;
    return result;
  }
  const Result& Next(const Particles& particles) { return Next(particles.AsFrame()); }
  absl::Status Try(const Frame& frame, const FrameControl& control = {}) {
    return reconstructor.Reconstruct(frame, state, workspace, result, control);
  }

  Reconstructor reconstructor;
  State state;
  Workspace workspace;
  Result result;
};

}  // namespace partiemc::support
