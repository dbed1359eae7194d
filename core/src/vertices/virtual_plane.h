// The default placement, steps 1 to 3: vertices on the level set, then on virtual planes supported
// by the nearby particles (core/METHOD.md, "The default placement").
#pragma once

#include "vertices/vertices.h"

namespace partiemc {

/// The middle of the segment, moved towards F = 0 by one Newton step of at most `max_step` cells.
/// The middle itself if the gradient is weak. In cells from the origin of the world.
Point VirtualPlaneVertex(const CellPlane& plane, double max_step);

/// Runs steps 1 to 3 of the default placement (roots, normals, planes), and thinning (thinning.h).
/// Deterministic. Parallel over rings and parts of long
/// rings; stretches between walls follow one after another. Cost: for each vertex, a few field
/// samples and windows of about twenty vertices.
void PlaceOnVirtualPlanes(const VertexInput& input, RingVertices& vertices);

}  // namespace partiemc
