// Roots of the level set and normals at the vertices.
#pragma once

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

/// Moves the vertices from where they are by one Newton step, those in cells not out of their
/// cells. Sets their normals: the direction of the gradient, or if that is weak the one of the
/// loop or edge. Positions in cells. Parallel over cells.
void FindRoots(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
               const RootConstants& constants, std::vector<Vec3>& positions,
               std::vector<Vec3>& normals);

}  // namespace partiemc::space
