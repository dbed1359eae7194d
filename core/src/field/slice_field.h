// Stage 2 of 9 for slices: computes the level set on a plane through particles in space.
#pragma once

#include "bins/bins.h"
#include "field/field.h"
#include "frame/scale.h"

namespace partiemc {

/// Like SampleField, for particles with heights above the plane (ParticleBins::height). At every
/// node, F is computed in space (SliceSums). Deterministic: the sums of a node run over the
/// particles of its tile and the neighbours in one order, in doubles. Parallel over tiles. Cost:
/// linear in the particles of the slab, times the square of the kernel radius in cells.
void SampleSlice(const ParticleBins& bins, const Scale& scale, LevelSet& level_set);

}  // namespace partiemc
