// The free stretches of rings between walls (core/WALLS.md).
#pragma once

#include <cstddef>

#include "absl/functional/function_ref.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Calls `visit` for each free stretch of a ring that meets walls: a part between two contacts with
/// walls. `vertices.stretch` then has the stretch's vertices, without contacts. Points on the curve
/// of a contact (contact_curve.h) extend each end, from the wall to `reach` cells, times the local
/// size at the end, beyond the wall.
/// An end whose contact has no curve is not extended. Skips stretches with fewer than three points.
///
/// Before `visit`, moves the vertices between a contact and the fitted part of its curve, and their
/// normals, onto the curve: kernels near a wall see no particles beyond the wall.
void ForEachStretch(const VertexInput& input, std::size_t ring, double reach,
                    RingVertices& vertices, absl::FunctionRef<void()> visit);

}  // namespace partiemc
