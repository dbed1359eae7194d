// Where outlines meet walls: the contacts and their angles (core/WALLS.md).
#pragma once

#include <cstdint>
#include <span>

#include "base/point.h"
#include "partiemc/result.h"
#include "vertices/wall_vertices.h"

namespace partiemc {

struct VertexInput;

/// Moves each contact, the end of a free stretch on a wall, to where the curve of the stretch
/// (contact_curve.h) meets the wall. The vertices between the contact and the fitted part move onto
/// the curve. Vertices on the wall that the contact passes move ahead of it. A contact stops at
/// sharp corners of its wall, before the next contact and before another wall; then a straight line
/// replaces the curve. Without a curve a contact stays. Sets the angles of contacts: by the curve,
/// or by a chord of two local sizes for a contact that stopped or stayed.
///
/// Call it before the area step (CorrectVolume), whose target counts the wetted area, and after the
/// area step, because that step moves the curves. `points` has the points of `rings`. `sizes`: by
/// point, the local size; empty for equal sizes. Cost: for each contact, linear in the lines near
/// it and in the vertices of its stretch.
void FitContacts(const VertexInput& input, std::span<const float> sizes, WallVertices& points,
                 Rings& rings);

/// Where a free point goes that is in a solid, or closer to it than .02 local sizes: to this
/// distance before its wall. Other points, and those deeper than WallField::kMostHeight, stay. In
/// cells. `tile`: WallVertices::tile of the point. `spacing`: the spacing times the local size.
Point KeepOffWalls(const WallField& walls, std::uint32_t tile, double spacing, const Point& given);

/// Moves points on walls to their places (WallVertices::place), and keeps free points off walls
/// (KeepOffWalls). `sizes`: as for FitContacts.
void PinToWalls(const VertexInput& input, std::span<const float> sizes, const WallVertices& points,
                Rings& rings);

/// Appends the wet points (WallVertices::is_wet) to Rings::wetted, and the contacts and their
/// angles to Rings::contacts and contact_angles.
void ListContacts(const WallVertices& points, Rings& rings);

}  // namespace partiemc
