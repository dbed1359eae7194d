// Checks the spacing in use against the particles of a frame.
#pragma once

#include "bins/bins.h"
#include "frame/scale.h"

namespace partiemc {

/// Whether enough particles of a frame contradict the spacing in use (AreEnough in near_ring.h). A
/// particle contradicts it if its tile has more than four particles per squared spacing, or if it
/// is surrounded at a distance above 2.4 or below 0.5 spacings. Spray, films and single particles
/// do not count. Only a sample is checked, so small parts of a frame may be missed. The sample does
/// not depend on the order of the particles. Requires: bins of this scale. Cost: visits a few ten
/// thousand particles; up to a million if the first samples contradict.
bool ContradictsSpacing(const ParticleBins& bins, const Scale& scale);

}  // namespace partiemc
