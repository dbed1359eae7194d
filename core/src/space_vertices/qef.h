// The placement `qef`: vertices in cells at the least square of the distances from tangent planes.
//
// Ju, Losasso, Schaefer, Warren: Dual Contouring of Hermite Data, 2002; with the regularisation
// towards the mean of the crossings instead of a truncated inverse.
#pragma once

#include <vector>

#include "base/vec3.h"
#include "frame/scale.h"
#include "space/bins.h"
#include "space/crossings.h"

namespace partiemc::space {

/// Samples the level set at the crossings of the edges for their normals. Moves each vertex in a
/// cell to the point x that minimises sum (n . (x - e))^2 + .05 |x - mean|^2 over the crossings e
/// of its loop, not out of the cell. Its normal is the normalised mean of the n. In cells. Parallel
/// over bricks and cells.
/// Requires: vertices at their crossings. Sets all normals.
void PlaceByQef(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
                std::vector<Vec3>& positions, std::vector<Vec3>& normals);

}  // namespace partiemc::space
