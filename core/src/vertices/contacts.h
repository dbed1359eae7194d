// Where outlines meet walls: the contacts and their angles (core/WALLS.md).
#pragma once

#include "partiemc/result.h"
#include "vertices/wall_vertices.h"

namespace partiemc {

struct VertexInput;

/// Moves each contact to where the curve of its stretch (contact_curve.h) meets the wall, and the
/// vertices below the fitted part onto the curve. Vertices on the wall that the contact passes move
/// ahead of it. A contact stops at sharp corners of its wall and before the next contact; then a
/// straight line replaces the curve. Without a curve a contact stays. Sets the angles of contacts.
///
/// Call it before the area step, whose target counts the wetted area, and after it, because that
/// step moves the curves. `points` has the points of `rings`. Cost: for each contact, linear in the
/// lines near it and in the vertices of its stretch.
void FitContacts(const VertexInput& input, WallVertices& points, Rings& rings);

/// Moves points on walls to their places, and free points in a solid, or too close to it, out of
/// it.
void PinToWalls(const VertexInput& input, const WallVertices& points, Rings& rings);

/// Appends to Rings::wetted, contacts and contact_angles.
void ListContacts(const WallVertices& points, Rings& rings);

}  // namespace partiemc
