// Places the vertices on edges by the vertices in the cells around them.
#pragma once

#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/crossings.h"
#include "space/lattice.h"

namespace partiemc::space {

/// Moves each vertex e on an edge from its anchor along its normal n to the surface through the
/// loops around it, at most four. The height is the mean of (n + n_j) / 2 . (c_j - e) with the
/// weights 1 / d^2. The normal is the normalised mean of the n_j with the same weights. Exact on
/// spheres and planes. If `sizes` is not empty, the local size of e is the same mean. Requires:
/// positions, normals and sizes of the vertices in cells are set. Lengths are in cells. Parallel
/// over bricks.
void PlaceEdgesByLoops(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                       const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                       std::vector<Vec3>& normals, std::span<float> sizes = {});

}  // namespace partiemc::space
