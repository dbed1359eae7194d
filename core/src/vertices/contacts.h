// Where outlines meet walls: the contacts and their angles (core/WALLS.md).
#pragma once

#include "partiemc/result.h"
#include "vertices/wall_vertices.h"

namespace partiemc {

struct VertexInput;

/// Moves each contact to where the curve of its stretch (contact_curve.h) meets the wall, and the
/// vertices below the fitted part onto the curve. The vertices on the wall that the contact passes
/// move ahead of it. A contact stays before sharp corners of its wall, and where there is no curve.
/// Call it before the area step, whose target counts the wetted area, and after it, because that
/// step moves the curves. `points`: of `rings`. Cost: for each contact, linear in the lines near it
/// and in the vertices of the stretch.
void FitContacts(const VertexInput& input, WallVertices& points, Rings& rings);

/// Moves vertices on walls to their places, and free vertices in the solid out of it.
void PinToWalls(const VertexInput& input, const WallVertices& points, Rings& rings);

/// Sets Rings::wetted, contacts and contact_angles.
void ListContacts(const WallVertices& points, Rings& rings);

}  // namespace partiemc
