// The angles of the phases where interfaces meet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "vertices/wall_vertices.h"

namespace partiemc {

/// A ring of a phase. `points`: numbers of shared points. By shared point: `world` has its
/// position, interleaved, in world units, `is_junction` whether interfaces end there.
struct PhaseRing {
  std::span<const std::uint32_t> points;
  std::span<const double> world;
  std::span<const std::uint8_t> is_junction;
  const WallVertices* walls =
      nullptr;  ///< By point of the body (PointNumbers); null without walls.
};

/// The angle of the phase inside of the ring at its point `k`, a junction, in radians, in [0, 2
/// pi]. Each side of the ring has a curve (arc_curve.h), fitted to its points before the next
/// junction. The junction counts as a point if it lies inside of the body (`is_inside`). Absent if
/// a side has fewer than four points from 1.5 to 9 spacings away along the ring, or no curve. A
/// side along a wall has the direction of the wall; curves end at walls.
/// `spacing`: world units. Cost: linear in these points.
std::optional<float> JunctionAngle(const PhaseRing& ring, std::size_t k, bool is_inside,
                                   double spacing);

}  // namespace partiemc
