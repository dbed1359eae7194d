// Places the crossings of lattice edges on the surfaces of grains.
#pragma once

#include "crossings/crossings.h"
#include "field/field.h"
#include "rings/rings.h"
#include "sampler/level_set_sampler.h"

namespace partiemc {

/// Replaces the linear crossings of RingTopology::entry_points by roots of F on their lattice
/// edges. F there is within 1e-4 cells of 0, except next to a node or after eight samples. At
/// grains of two cells, linear crossings have errors of up to a quarter of a cell. Deterministic.
/// Parallel over segments. Cost: about three field samples for each segment.
void FindGrainCrossings(const TileDirectory& directory, const LevelSet& level_set,
                        const Crossings& crossings, const LevelSetSampler& field,
                        RingTopology& rings);

}  // namespace partiemc
