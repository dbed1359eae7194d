// Runs the stages in space up to the field. For tests of the core only: it includes private
// headers.
#pragma once

#include <gtest/gtest.h>

#include "frame/scale.h"
#include "space/bins.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/space_particles.h"

namespace partiemc::support {

/// Outputs of the stages for one frame.
struct SpaceStages {
  space::SpaceBins bins;
  space::SpaceField field;
  space::SpaceCrossings crossings;

  SpaceStages(const SpaceParticles& particles, const Scale& scale) {
    EXPECT_TRUE(BinParticles(particles.AsFrame(), scale, {}, bins).ok());
    SampleField(bins, scale, field);
    FindCrossings(bins.bricks, field, crossings);
    EvaluateNodes(bins, scale, crossings.near, field);
  }
};

}  // namespace partiemc::support
