// Checks the given spacing of a surface by the distances of its particles.
#pragma once

#include "frame/scale.h"
#include "space/bins.h"

namespace partiemc::space {

/// Whether enough of at most 64 sampled particles contradict the spacing (core/SURFACES.md,
/// "Doubts"). A particle contradicts it if other positions lie all around, and the sixth nearest is
/// farther than 1.7 or closer than .7 spacings. With own sizes, a distance is divided by the mean
/// size of the two particles. Requires: SortParticles. Cost: some ten thousand distances if the
/// spacing is right; at most 32 times the number of particles, between one and 34 million.
bool ContradictsSpacing(const SpaceBins& bins, const Scale& scale);

}  // namespace partiemc::space
