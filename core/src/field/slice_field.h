// Stage 2 of 9, where the outline is a section of a body in space.
#pragma once

#include "bins/bins.h"
#include "field/field.h"
#include "frame/scale.h"

namespace partiemc {

/// As SampleField, for particles that have heights above the plane (ParticleBins::height): F at
/// every node is that of space (SliceSums). Deterministic: the sums of a node run over the lists of
/// its tile and of the neighbours in one order, in doubles. Parallel over tiles. Cost: linear in
/// the particles of the slab, times the square of the kernel radius in cells.
void SampleSlice(const ParticleBins& bins, const Scale& scale, LevelSet& level_set);

}  // namespace partiemc
