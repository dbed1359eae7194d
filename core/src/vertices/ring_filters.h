// Filters along a ring: weighted sums over windows (core/METHOD.md, "The default placement").
// Vectorised with run-time dispatch.
#pragma once

#include <cstddef>
#include <span>

#include "vertices/periodic_ring.h"

namespace partiemc {

/// Largest number of vertices that vectors read beyond the end of a window.
inline constexpr std::ptrdiff_t kWindowPadding = 17;

/// Computes arc lengths and weights of a ring, including the margins. `sizes`: the local size of
/// each vertex, by which lengths are divided (LengthInSizes); empty if all are 1.
/// Requires: coordinates are repeated in the margins; margins have at least kWindowPadding
/// vertices.
void MeasureArc(const PeriodicRing& ring, std::span<const float> sizes);

/// The three functions below process the vertices [begin, end) of a ring. Each sums over the
/// vertices j nearer than `reach` cells (with own sizes, local sizes times cells) along the ring,
/// with weights that contain l_j B(d, reach). Arithmetic is in floats, one vertex for each lane. A
/// sum starts with the vertex itself. It continues outward with one vertex on each side, the
/// earlier one first, until the window ends. The bits depend neither on the width of vectors nor on
/// `begin`. Requires: the ring is at least two reaches long; its margins have the size of
/// SizeForWindows plus kWindowPadding.

/// Writes the unit mean of the normals to next_x and next_y. `by_angle` multiplies the weights by
/// max(0, n_i . n_j)^16. If normals cancel, the vertex keeps its own normal.
void MeanNormals(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach,
                 bool by_angle);

/// Writes the curvature to `shift`: the change of the normals along the tangent, positive where the
/// ring is convex.
void MeanCurvature(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                   double reach);

/// Writes to `shift` how far each vertex moves along its normal: to the mean of the neighbours'
/// planes, each moved by its `base`. Weights contain max(0, n_i . n_j)^16.
void MeanShift(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach);

}  // namespace partiemc
