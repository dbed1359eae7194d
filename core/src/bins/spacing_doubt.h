// Checks the spacing in use against the particles of a frame.
#pragma once

#include "bins/bins.h"
#include "frame/scale.h"

namespace partiemc {

/// Whether enough particles are surrounded (near_ring.h) at distances that show more than twice, or
/// less than half, the spacing in use. Between 2 and 2.4 times it depends on their arrangement.
/// Spray, films and single particles do not count. Checks a sample that does not depend on the
/// order of the particles, so small parts of a frame may be missed. Requires: bins of this scale.
/// Cost: a few ten thousand particles; a million if the first samples contradict.
bool ContradictsSpacing(const ParticleBins& bins, const Scale& scale);

}  // namespace partiemc
