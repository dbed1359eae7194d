// Moves the points where interfaces meet to where their curves meet.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "frame/scale.h"
#include "partiemc/result.h"
#include "phases/interfaces.h"

namespace partiemc {

/// Warm buffers of MoveJunctions.
struct JunctionScratch {
  struct ArcEnd {
    std::uint32_t junction;  // Number of a shared point.
    std::uint32_t arc;
    bool is_start;
  };
  std::vector<ArcEnd> ends;              // By junction, then arc.
  std::vector<std::uint8_t> is_contact;  // By point of the body: whether interfaces end there.
  std::vector<std::uint8_t> has_moved;   // By point of the body: 0, kMoved or kMovedCorner.
};

/// Near a junction, the field of each phase sees a corner and rounds it. Each arc therefore has a
/// curve, fitted to its points from 1.5 to 9 spacings away (arc_curve.h). The junction moves to the
/// point nearest to these curves. The points before 1.5 spacings go onto an arc to it. A vertex of
/// the body's rings moves along its ring, at most to the next vertices. At a corner of the body it
/// moves as other junctions, with the curves of both sides of the ring, and so do the points beside
/// it; their normals turn. Sets has_moved of these points. Requires: has_moved has an element for
/// each point of the body.
/// Cost: linear in the points near junctions.
void MoveJunctions(const Scale& scale, const Rings& body, const Interfaces& interfaces,
                   JunctionScratch& scratch, SharedPoints& points);

}  // namespace partiemc
