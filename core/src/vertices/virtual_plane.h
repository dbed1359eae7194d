// The default placement, steps 1 to 3: vertices on the level set, then on virtual planes supported
// by the nearby particles (core/METHOD.md, "The default placement").
#pragma once

#include "vertices/vertices.h"

namespace partiemc {

/// One Newton step from the middle of the segment to F = 0 along the cell plane's normal, of at
/// most `max_step` cells; none where the gradient is weak. In lattice coordinates.
Point VirtualPlaneVertex(const CellPlane& plane, double max_step);

/// Steps 1 to 3: roots, normals, planes. Leaves the rest to volume_correction.h and repair.h.
/// Deterministic, in parallel over segments, rings and stretches of long rings. Cost: a few field
/// samples and a window of about twenty vertices per vertex.
void PlaceOnVirtualPlanes(const VertexInput& input, RingVertices& vertices);

}  // namespace partiemc
