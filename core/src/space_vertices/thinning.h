// Drops vertices on edges that the surface hardly needs, and keeps the proof of the certificate.
//
// Four quads meet at the vertex E of a crossed edge a b, between the vertices C1..C4 of the cells
// around it. If all are cut across cells, the tetrahedra (a, E, Ci, Cj) and (E, b, Ci, Cj) fill the
// octahedron a, b, C1..C4. Without E, two triangles over C1..C4 divide it into four tetrahedra.
// These fill the same octahedron if they are positive: if a is below and b above both triangles.
// Octahedra of different edges do not overlap, so each edge is decided alone (core/SURFACES.md,
// "Thinning").
#pragma once

#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/crossings.h"
#include "space/lattice.h"
#include "space/mesh.h"
#include "space_certificate/certificate.h"

namespace partiemc::space {

/// Finds the vertices on edges that can be dropped and are at most `distance`, in cells, from the
/// triangles that replace them. Sets `thin` by vertex on an edge, empty if the vertex stays. Takes
/// the nearer of two valid cuts. `distance` 0 drops none. `sizes`: by vertex, factors of the
/// distance, or empty. Positions are in world units. Requires: Certify has accepted them.
/// Parallel over bricks.
void FindThinEdges(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                   const Certificate& certificate, const std::vector<Vec3>& positions,
                   double distance, std::vector<ThinQuad>& thin, std::span<const float> sizes = {});

/// The triangles of all quads in their modes, without the vertices that are dropped.
void EmitQuads(const BrickDirectory& bricks, const SpaceCrossings& crossings,
               const Certificate& certificate, std::span<const ThinQuad> thin,
               std::vector<VertexTriangle>& triangles);

}  // namespace partiemc::space
