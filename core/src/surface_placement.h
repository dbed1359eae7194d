// Places the vertices of a surface and connects them by triangles.
#pragma once

#include "absl/status/status.h"
#include "frame/scale.h"
#include "partiemc/surface_reconstructor.h"
#include "surface_workspace.h"

namespace partiemc {

/// Places vertices on the crossed edges and connects them by triangles. Positions are in world
/// units afterwards. Requires: bins, field and crossings of the frame, with F at the nodes of the
/// crossed edges.
void PlaceByMarchingCubes(double cell_size, SurfaceWorkspace::Buffers& b);

/// Places vertices away from their anchors and connects them by quads that the certificate accepts.
/// Positions are in world units afterwards, because the certificate checks the final coordinates.
/// Requires: as PlaceByMarchingCubes, with the bodies and the steps of the crossings; a placement
/// other than kMarchingCubes. For kVirtualPlane also the body of each vertex. Vertices of settled
/// bodies (space_vertices/drops.h) stay at their anchors. Errors: INTERNAL if the certificate
/// refuses a face whose vertices are at their anchors.
absl::Status PlaceMovedVertices(const SurfaceParameters& parameters, const Scale& scale,
                                SurfaceWorkspace::Buffers& b);

}  // namespace partiemc
