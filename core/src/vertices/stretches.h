// The free stretches of rings between walls (core/WALLS.md).
#pragma once

#include <cstddef>

#include "absl/functional/function_ref.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Calls `visit` for each free stretch of a ring that meets walls, with `vertices.stretch` set to
/// its vertices and to points that continue it by `reach` cells beyond the walls, along the curves
/// of its contacts (contact_curve.h). Kernels near a wall see no particles beyond it, so the
/// vertices below the fitted part move onto the curve first. Where there is no curve, the stretch
/// ends at its last vertex.
void ForEachStretch(const VertexInput& input, std::size_t ring, double reach,
                    RingVertices& vertices, absl::FunctionRef<void()> visit);

}  // namespace partiemc
