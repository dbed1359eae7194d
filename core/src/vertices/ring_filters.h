// Sums over windows along a ring, in the vectors of the processor at hand.
#pragma once

#include <cstddef>

#include "vertices/periodic_ring.h"

namespace partiemc {

/// What vectors of up to sixteen vertices read beyond a window that ends in a margin.
inline constexpr std::ptrdiff_t kWindowPadding = 17;

/// Sets the arc and the weights of a ring by its coordinates, in the margins, too.
/// Requires: coordinates are repeated in the margins, of kWindowPadding vertices at least.
void MeasureArc(const PeriodicRing& ring);

/// Each of these functions sums, for each of the vertices [begin, end) of a ring, over the vertices
/// j less than `reach` from it along the ring, with weights that begin with l_j B(d, reach)
/// (core/METHOD.md, "The default placement"). A vertex per lane, in floats: first itself, then the
/// two vertices beside it, the one before it first, then the next two, until a window ends. The
/// bits are the same whatever the width of the vectors and wherever a stretch begins. Requires: the
/// ring is at least two reaches long; its margins hold what SizeForWindows says and kWindowPadding
/// more.

/// Unit mean of the normals, into next_x and next_y; with `by_angle`, weighted by the angle between
/// them, too (max(0, n_i . n_j)^16). The vertex's own normal where they cancel out.
void MeanNormals(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach,
                 bool by_angle);

/// How normals turn along the tangent, positive where the ring is convex, into shift.
void MeanCurvature(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end,
                   double reach);

/// The mean of what the neighbours' planes say, shifted by their bases, along the vertex's normal,
/// weighted by angle, into shift.
void MeanShift(const PeriodicRing& ring, std::ptrdiff_t begin, std::ptrdiff_t end, double reach);

}  // namespace partiemc
