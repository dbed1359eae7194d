// Sharpens the corners of the outlines of wall particles.
#pragma once

#include <cstdint>
#include <vector>

#include "base/point.h"
#include "partiemc/result.h"

namespace partiemc {

/// Scratch of SharpenCorners.
struct WallCornerScratch {
  struct Corner {
    std::uint32_t point;  // Of the ring, in the middle of the rounded part.
    Point at;
    double distance;  // Of `at` from the point.
  };
  std::vector<double> lengths;  // Along the ring up to each point.
  std::vector<Corner> corners;
  std::vector<double> points;
  std::vector<std::uint32_t> offsets;
};

/// Replaces rounded parts of rings by corners, because the field rounds corners by about .8 h. An
/// arm is the part of a ring from 1.5 to 4.5 h before or after a point. If both arms are straight
/// and differ by more than 30 degrees, their lines meet in a corner. The corner replaces the points
/// between the arms if it is less than 1.5 h away from the point. Arms that bend by more than a
/// seventh of the turn are part of a curve, which stays. Rings of at most 9 h stay. Changes only
/// the points and offsets of `rings`. `spacing`: the particle spacing h in world units. Cost:
/// near-linear in the points.
void SharpenCorners(double spacing, WallCornerScratch& scratch, Rings& rings);

}  // namespace partiemc
