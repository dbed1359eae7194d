// Roots of the level set and normals at the vertices in cells.
#pragma once

#include <span>
#include <vector>

#include "base/vec3.h"
#include "frame/scale.h"
#include "space/bins.h"
#include "space/crossings.h"

namespace partiemc::space {

struct RootConstants {
  double newton_step = .3;  ///< Longest step, in cells.
  double long_step = .07;   ///< After longer steps the gradient is evaluated again, in cells.
};

/// Moves the vertices in cells by one Newton step, but not out of their cells, and sets their
/// normals. If `sizes` is not empty, sets the local sizes there, in spacings. A normal is the
/// direction of the gradient, or, if the gradient is weak, the area normal of the loop. Vertices on
/// edges stay. Positions and normals by vertex, in cells. Parallel over cells.
void FindRoots(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
               const RootConstants& constants, std::vector<Vec3>& positions,
               std::vector<Vec3>& normals, std::span<float> sizes = {});

}  // namespace partiemc::space
