// How particles that are in two frames carry points from one into the other.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "point.h"
#include "point_buckets.h"

namespace partiemc {

/// A particle where it was, and the way that it has gone since. In cells.
struct Mover {
  Point at;
  Point way;
};

/// The displacement around movers: at every point that of a turn and a strain, fitted to the movers
/// near it.
class ParticleMotion {
 public:
  /// `reach`: how far a mover is heard of, in cells. In another order of `movers`
  /// sums differ by rounding. Cost: linear in the movers, serial.
  void Build(std::span<const Mover> movers, double reach);

  /// Where a point goes; nothing without a mover in reach. Movers weigh (1 - (d / reach)^2)^3. What
  /// moves as a rigid body is carried exactly but for what the ridge takes from its turn. Of a
  /// crowd those are heard of that came first to Build. Cost: the movers in reach, bounded.
  std::optional<Point> Carry(Point p) const;

 private:
  double reach_ = 0;
  PointBuckets<Mover> movers_;
};

}  // namespace partiemc
