// Moves the points where interfaces meet to where their lines meet.
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
};

/// Near a junction, the field of each phase sees a corner and rounds it. Each arc therefore has a
/// line, fitted to its points from kNearest to kFarthest spacings away. The junction moves to the
/// point nearest to these lines. The points before kNearest go onto a chord. A vertex of the body's
/// rings moves along its ring, at most to the next vertices.
/// Cost: linear in the points near junctions.
void MoveJunctions(const Scale& scale, const Rings& body, const Interfaces& interfaces,
                   JunctionScratch& scratch, SharedPoints& points);

}  // namespace partiemc
