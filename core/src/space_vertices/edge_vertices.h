// Places the vertices on edges by the vertices in the cells around them.
#pragma once

#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/crossings.h"
#include "space/lattice.h"

namespace partiemc::space {

/// Moves each vertex on an edge from its anchor e to the surface through the four loops around the
/// edge. These have vertices c_j with normals n_j. Means have the weights 1 / (|c_j - e|^2 + .01).
/// The normal n is the normalised mean of n_j. The vertex moves along n by the mean of
/// (n + n_j) / 2 . (c_j - e). Exact on spheres and planes. If `sizes` is not empty, the local size
/// is the mean of the sizes at c_j. Requires: positions, normals and sizes of the vertices in cells
/// are set. Lengths are in cells. Parallel over bricks.
void PlaceEdgesByLoops(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                       const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                       std::vector<Vec3>& normals, std::span<float> sizes = {});

}  // namespace partiemc::space
