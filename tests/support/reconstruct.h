// Reconstructs one frame in one call.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "partiemc/partiemc.h"
#include "support/particles.h"

namespace partiemc::support {

/// One frame of a new stream. Fails the test if it is refused.
inline Result ReconstructOnce(const ReconstructionParameters& parameters, const Frame& frame) {
  Result result;
  const auto reconstructor = Reconstructor::Create(parameters);
  EXPECT_TRUE(reconstructor.ok()) << reconstructor.status();
  if (!reconstructor.ok()) return result;
  State state;
  Workspace workspace;
  const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, result);
  EXPECT_TRUE(status.ok()) << status;
  return result;
}

inline Result ReconstructOnce(const ReconstructionParameters& parameters,
                              const Particles& particles) {
  return ReconstructOnce(parameters, particles.AsFrame());
}

/// Angle in degrees between a direction and its expected normal.
inline double AngleBetween(double ax, double ay, double bx, double by) {
  return std::abs(std::atan2(ax * by - ay * bx, ax * bx + ay * by)) * 180 / std::numbers::pi;
}

}  // namespace partiemc::support
