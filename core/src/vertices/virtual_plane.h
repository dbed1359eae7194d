// The default placement, steps 1 to 3: vertices on the level set, then on virtual planes supported
// by the nearby particles (core/METHOD.md, "The default placement").
#pragma once

#include "vertices/vertices.h"

namespace partiemc {

/// Moves the middle of the segment towards F = 0, by one Newton step of at most `max_step` cells
/// along the gradient. Returns the middle if the gradient is weak. In lattice coordinates.
Point VirtualPlaneVertex(const CellPlane& plane, double max_step);

/// Steps 1 to 3 (roots, normals, planes), and thinning. The area is matched by volume_correction.h,
/// and rings are repaired by repair.h. Deterministic, in parallel over segments, rings and
/// stretches of long rings. Cost: a few field samples and a window of about twenty vertices per
/// vertex.
void PlaceOnVirtualPlanes(const VertexInput& input, RingVertices& vertices);

}  // namespace partiemc
