// The default placement, step 4: drops vertices on nearly straight parts of rings.
#pragma once

#include <cstddef>

#include "vertices/vertices.h"

namespace partiemc {

/// Sets `vertices.is_kept` of the vertices of a ring.
///
/// Drops edge vertices that lie nearly on the chord of the neighbouring cell vertices. Where
/// particles are at least two cells wide, it drops cell vertices, too, and keeps the vertices in
/// each second column of cells; in each second row if the outline is steep. From four cells on it
/// keeps each fourth column, from eight on each eighth. Columns and rows are fixed in space, so the
/// choice does not depend on the start of the ring and seldom changes while the outline moves. All
/// cell vertices between two kept ones stay if one of them is too far from their chord, or outside
/// of the rectangle of cells around it.
///
/// Cell vertices are dropped only in frames with own sizes, without grains, phases and boxes, and
/// not in rings that meet a wall. Cost: linear in the vertices.
void ThinRing(const VertexInput& input, std::size_t ring, RingVertices& vertices);

/// Keeps all cell vertices again. Returns false if none was dropped.
bool KeepCellVertices(RingVertices& vertices);

}  // namespace partiemc
