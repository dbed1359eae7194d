// Filters along a ring: weighted sums over windows (core/METHOD.md, "The default placement").
// Vectorised with run-time dispatch.
#pragma once

#include <cstddef>

#include "vertices/periodic_ring.h"

namespace partiemc {

/// Largest number of vertices that vectors read beyond the end of a window.
inline constexpr std::ptrdiff_t kWindowPadding = 17;

/// Computes arc lengths and weights of a ring, including the margins.
/// Requires: coordinates are repeated in the margins; margins have at least kWindowPadding
/// vertices.
void MeasureArc(const PeriodicRing& ring);

/// The three functions below process the vertices [begin, end) of a ring. Each sums over the
/// vertices j nearer than `reach` cells along the ring, with weights that contain l_j B(d, reach).
/// Arithmetic is in floats, one vertex for each lane. A sum starts with the vertex itself and
/// continues with the next vertex on each side, the one before first, until the window ends. The
/// bits do not depend on the width of vectors or on `begin`.
/// Requires: the ring is at least two reaches long; its margins have the size of SizeForWindows
/// plus kWindowPadding.

/// Writes the unit mean of the normals to next_x and next_y. `by_angle` multiplies the weights by
/// max(0, n_i . n_j)^16. If normals cancel, the vertex keeps its own normal.
void MeanNormals(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach,
                 bool by_angle);

/// Writes the curvature, positive where the ring is convex, to shift: the change of the normals
/// along the tangent.
void MeanCurvature(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                   double reach);

/// Writes the shift of each vertex along its normal to shift: to the mean of the neighbours'
/// planes, each moved by its base, with weights by angle as above.
void MeanShift(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach);

}  // namespace partiemc
