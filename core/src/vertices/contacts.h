// Where outlines meet walls: the contacts and their angles (core/WALLS.md).
#pragma once

#include "partiemc/result.h"
#include "vertices/wall_vertices.h"

namespace partiemc {

struct VertexInput;

/// Near a wall, the field sees no particles beyond it, so the outline there is wrong by up to a
/// spacing. The stretch from 1.5 to 6 h above the wall therefore continues to the wall: a parabola,
/// t = a + b w + c w^2 in the height w above the wall and the length t along it, fitted to its
/// vertices by least squares. Moves each contact to where its parabola meets the wall, and the
/// vertices below 1.5 h onto it. The vertices on the wall that the contact passes move ahead of it.
/// A contact stays before sharp corners of its wall, and where its stretch is too low for a fit.
/// `points`: of `rings`. Cost: for each contact, linear in the lines of its wall and the vertices
/// of the stretch.
void FitContacts(const VertexInput& input, WallVertices& points, Rings& rings);

/// Moves vertices on walls to their places, and free vertices in the solid out of it.
void PinToWalls(const VertexInput& input, const WallVertices& points, Rings& rings);

/// Sets Rings::wetted, contacts and contact_angles.
void ListContacts(const WallVertices& points, Rings& rings);

}  // namespace partiemc
