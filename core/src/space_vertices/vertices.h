// Anchors of vertices, and normals from triangles.
#pragma once

#include <algorithm>
#include <vector>

#include "base/vec3.h"
#include "frame/scale.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/mesh.h"

namespace partiemc::space {

/// Least distance of a linear crossing from the ends of its edge, in cells. Rounding to world
/// coordinates then cannot move it to a node.
inline constexpr double kEdgeMargin = 1.0 / 4096;
/// Least distance of an anchor from the ends of its edge, or of a vertex in a cell from the faces
/// of the cell, in cells. For vertices that move: tetrahedra at a node then have room for the
/// displacements. 1 % of the vertices of balls, tori and boxes are set back, 2 % with .02.
inline constexpr double kAnchorMargin = .12;

/// The point nearest to `point` that is at least kAnchorMargin away from the faces of the cell at
/// `low`.
inline Vec3 ClampedToCell(const Vec3& point, const Vec3& low) {
  const auto clamp = [](double value, double from) {
    return std::clamp(value, from + kAnchorMargin, from + 1 - kAnchorMargin);
  };
  return {clamp(point.x, low.x), clamp(point.y, low.y), clamp(point.z, low.z)};
}

/// Places vertices on edges at the linear crossings of F, at least `margin` away from the nodes.
/// Places vertices in cells at the mean of the crossings of their loop. Lengths are in cells.
void PlaceOnCrossings(const BrickDirectory& bricks, const SpaceField& field,
                      const SpaceCrossings& crossings, double margin, std::vector<Vec3>& positions);

/// The weights of the triangles around a vertex in its normal.
enum class NormalWeights {
  kArea,  ///< The area of the triangle.
  /// sin(a) / (l m) for the angle a between the sides of the lengths l and m at the vertex. Exact
  /// where the vertices lie on a sphere (Max, Journal of Graphics Tools 4(2), 1999).
  kSphere,
};

/// Sets each normal to the normalised weighted sum over its triangles; (0, 0, 1) if the sum is 0.
void NormalsFromTriangles(NormalWeights weights, const std::vector<Vec3>& positions,
                          const std::vector<VertexTriangle>& triangles, std::vector<Vec3>& normals);

}  // namespace partiemc::space
