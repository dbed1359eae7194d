// The surface of one frame, checked.
#pragma once

#include <gtest/gtest.h>

#include "partiemc/surface_reconstructor.h"
#include "space/space_particles.h"

namespace partiemc::support {

/// Expects that the surface satisfies S1 to S5.
inline Surface SurfaceOf(const SpaceParticles& particles, const SurfaceParameters& parameters,
                         SurfaceWorkspace& workspace) {
  Surface surface;
  const auto reconstructor = SurfaceReconstructor::Create(parameters);
  EXPECT_TRUE(reconstructor.ok()) << reconstructor.status();
  if (!reconstructor.ok()) return surface;
  const absl::Status status = reconstructor->Reconstruct(particles.AsFrame(), workspace, surface);
  EXPECT_TRUE(status.ok()) << status;
  const absl::Status valid = Validate(surface);
  EXPECT_TRUE(valid.ok()) << valid;
  return surface;
}

inline Surface SurfaceOf(const SpaceParticles& particles, const SurfaceParameters& parameters) {
  SurfaceWorkspace workspace;
  return SurfaceOf(particles, parameters, workspace);
}

/// The sum of the volumes of the shells.
inline double VolumeOf(const Surface& surface) {
  double volume = 0;
  for (const ShellMeasures& shell : surface.measures) volume += shell.volume;
  return volume;
}

}  // namespace partiemc::support
