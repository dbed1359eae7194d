// Judges the spacing of a surface by the distances of its particles.
#pragma once

#include "frame/scale.h"
#include "space/bins.h"

namespace partiemc::space {

/// Whether enough of 64 sampled particles, with others all around, are farther apart than 1.7 or
/// closer than .7 spacings. With own sizes, distances count in mean sizes of both particles. The
/// sixth of the nearest other positions decides: it is 1 to 1.2 spacings away in lattices and
/// random points, up to 1.4 at a free surface (core/SURFACES.md, "Doubts"). Requires: sorted
/// particles. Cost: at most about a million distances; in a frame whose spacing is right, some ten
/// thousand.
bool ContradictsSpacing(const SpaceBins& bins, const Scale& scale);

}  // namespace partiemc::space
