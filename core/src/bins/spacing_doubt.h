// Whether a frame's particles have another spacing than they are taken for.
#pragma once

#include "bins/bins.h"
#include "frame/scale.h"

namespace partiemc {

/// Whether enough of the particles are surrounded (near_ring.h) at distances that tell a spacing of
/// more than twice, or less than half, the one in use; between 2 and 2.4 times it depends on their
/// arrangement. Spray, films and single particles do not count. Asks a sample of the particles that
/// does not depend on their order, so that small parts of a frame may go unseen. Requires: bins of
/// this scale. Cost: a few ten thousand looks at particles; a million where the first ones asked
/// give cause.
bool ContradictsSpacing(const ParticleBins& bins, const Scale& scale);

}  // namespace partiemc
