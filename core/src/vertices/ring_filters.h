// Filters along a ring: weighted sums over windows (core/METHOD.md, "The default placement").
// Vectorised with run-time dispatch.
#pragma once

#include <cstddef>
#include <span>

#include "vertices/periodic_ring.h"

namespace partiemc {

/// Most vertices that vectors read beyond the end of a window.
inline constexpr std::ptrdiff_t kWindowPadding = 17;

/// Computes `arc` and `weight` of a ring, including the margins. `sizes`: by vertex, the local
/// size, by which lengths are divided (LengthInSizes); empty if all are 1.
/// Requires: margins of at least kWindowPadding vertices, with the coordinates.
void MeasureArc(const PeriodicRing& ring, std::span<const float> sizes);

/// The three functions below process the vertices [begin, end) of a ring. Each sums over a window:
/// the vertices j at arc lengths d < `reach` from the vertex, in cells (if sizes differ, in cells
/// divided by the local size). Weights have the factor l_j B(d, reach). Here l_j is the `weight` of
/// PeriodicRing, and B(d, r) = max(0, 1 - d^2 / r^2)^2. Arithmetic is in floats, one vertex for
/// each lane. A sum starts with the vertex itself. The sum continues outward with one vertex on
/// each side, the earlier one first. The bits depend neither on the width of vectors nor on
/// `begin`.
/// Requires: the ring is at least two reaches long; its margins have the size of SizeForWindows
/// plus kWindowPadding.

/// Writes for each vertex the mean of the normals in its window, scaled to unit length, to next_x
/// and next_y. If `by_angle` is set, weights also have the factor max(0, n_i . n_j)^16. Where
/// normals cancel, a vertex keeps its own normal.
void MeanNormals(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach,
                 bool by_angle);

/// Writes the curvature, per cell, to `shift`: the change of the normals in the window along the
/// tangent, positive where the ring is convex. 0 if the window has no extent along the tangent.
void MeanCurvature(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                   double reach);

/// Writes to `shift`, in cells, how far each vertex moves along its normal to the mean of the
/// planes in its window. Each plane is shifted by its `base`. Weights also have the factor
/// max(0, n_i . n_j)^16.
void MeanShift(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach);

}  // namespace partiemc
