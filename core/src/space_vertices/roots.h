// Moves the vertices in cells towards roots of the level set, and finds their normals.
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
  double long_step = .07;   ///< In cells. After a longer step the gradient is evaluated again.
};

/// Moves the vertices in cells by one Newton step, at most to kAnchorMargin from the faces of their
/// cells, and sets their normals. If `sizes` is not empty, sets their local sizes, in spacings. A
/// normal is the direction of the gradient. If the gradient is weak, the vertex stays, and its
/// normal is the area normal of the loop. Vertices on edges stay without a normal. Arrays are by
/// vertex, lengths in cells. Parallel over bricks.
void FindRoots(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
               const RootConstants& constants, std::vector<Vec3>& positions,
               std::vector<Vec3>& normals, std::span<float> sizes = {});

}  // namespace partiemc::space
