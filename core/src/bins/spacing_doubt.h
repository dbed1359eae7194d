// Checks the spacing in use against the particles of a frame.
#pragma once

#include "bins/bins.h"
#include "frame/scale.h"

namespace partiemc {

/// Whether the particles of a frame contradict the spacing in use: enough of them are surrounded
/// (near_ring.h) at distances that show more than twice, or less than half, this spacing. A spacing
/// of 2 to 2.4 times is found only for some arrangements. Spray, films and single particles do not
/// count. Only a sample is checked, which does not depend on the order of the particles, so small
/// parts of a frame may be missed. Requires: bins of this scale. Cost: visits a few ten thousand
/// particles; a million if the first samples contradict.
bool ContradictsSpacing(const ParticleBins& bins, const Scale& scale);

}  // namespace partiemc
