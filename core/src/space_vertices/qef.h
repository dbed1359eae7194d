// The placement `qef`: vertices in cells minimise the squared distances from tangent planes.
//
// Ju, Losasso, Schaefer, Warren: Dual Contouring of Hermite Data, 2002. A weight of the mean of the
// crossings replaces their truncated inverse.
#pragma once

#include <span>
#include <vector>

#include "base/vec3.h"
#include "frame/scale.h"
#include "space/bins.h"
#include "space/crossings.h"

namespace partiemc::space {

struct TangentPlane {
  Vec3 point, normal;  ///< The normal has length 1.
};

/// The point x that minimises sum (n . (x - e))^2 + .05 |x - mean|^2 over planes through points e
/// with normals n.
Vec3 LeastSquarePoint(std::span<const TangentPlane> planes, const Vec3& mean);

/// Sets the normals of vertices on edges to the direction of the gradient, or of the edge, outward,
/// if the gradient is 0. Moves each vertex in a cell to the LeastSquarePoint of the crossings of
/// its loop, but at most to kAnchorMargin from the faces of the cell. Its normal is the normalised
/// mean of the normals of these crossings. Lengths are in cells. Parallel over bricks and cells.
/// Requires: PlaceOnCrossings has set the positions.
void PlaceByQef(const SpaceBins& bins, const Scale& scale, const SpaceCrossings& crossings,
                std::vector<Vec3>& positions, std::vector<Vec3>& normals);

}  // namespace partiemc::space
