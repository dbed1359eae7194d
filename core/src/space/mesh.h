// Last stage: triangles and vertices -> surface, by shell.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "partiemc/surface.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/field.h"

namespace partiemc::space {

/// A quad of vertices in cells that replaces the vertex on an edge (thinning.h): counter-clockwise
/// as seen from outside. Its diagonal joins the first and the third corner.
struct ThinQuad {
  std::array<std::uint32_t, 4> corners{kNoIndex, kNoIndex, kNoIndex, kNoIndex};

  bool IsEmpty() const { return corners[0] == kNoIndex; }
};

/// The input of AssembleSurface.
struct MeshInput {
  const BrickDirectory& bricks;
  const SpaceField& field;
  const SpaceCrossings& crossings;
  const Bodies& bodies;
  /// By vertex of SpaceCrossings, then by vertex of drops (space_vertices/drops.h). World units.
  std::span<const Vec3> positions;
  std::span<const Vec3> normals;   ///< As `positions`; unit length.
  std::span<const ThinQuad> thin;  ///< By vertex on an edge. Empty: all these vertices stay.
};

using VertexTriangle = std::array<std::uint32_t, 3>;  ///< Indices of MeshInput::positions.

struct MeshScratch {
  std::vector<VertexTriangle> triangles;
  std::vector<std::uint32_t> parent, shell_of, point_of, next;
  std::vector<std::uint32_t> body_of_shell;  ///< Set by AssembleSurface; kNoIndex for ellipsoids.
};

/// The triangles of marching cubes, cell by cell. Their corners are vertices on edges. In loops of
/// more than six crossings, one corner is the vertex in the cell.
void EmitMarchingCubes(const SpaceCrossings& crossings, std::vector<VertexTriangle>& triangles);

/// Sets area, volume and centroid of a shell from its triangles. The area leaves out the triangles
/// in `surface.cuts`.
void MeasureShell(std::uint32_t shell, Surface& surface);

/// Copies `scratch.triangles` and their vertices to `surface`, by shell, and measures the shells.
/// Shells are ordered by their first vertex. The outer shell of a body is the shell directly below
/// its lowest node.
void AssembleSurface(const MeshInput& input, MeshScratch& scratch, Surface& surface);

}  // namespace partiemc::space
