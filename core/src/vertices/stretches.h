// The free stretches of rings between walls (core/WALLS.md).
#pragma once

#include <cstddef>

#include "absl/functional/function_ref.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Calls `visit` for each free stretch of a ring that meets walls. `vertices.stretch` then has the
/// stretch's vertices, without contacts. At both ends follow points on the curve of the contact
/// (contact_curve.h), from the wall to `reach` cells beyond it. If a contact has no curve, the
/// stretch ends at its last vertex. Skips stretches with fewer than three points.
///
/// First moves the vertices below the fitted part of a curve, and their normals, onto the curve:
/// kernels near a wall see no particles beyond it.
void ForEachStretch(const VertexInput& input, std::size_t ring, double reach,
                    RingVertices& vertices, absl::FunctionRef<void()> visit);

}  // namespace partiemc
