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

/// The field rounds corners by about .8 h. An arm is the part of a ring from 1.5 to 4.5 h away from
/// a point. If both arms are straight and differ by more than 30 degrees, their lines meet in a
/// corner, which replaces the points between the arms. Arms that bend by more than a seventh of the
/// turn are part of a curve, which stays. Changes only the points and offsets of `rings`.
/// `spacing`: h in world units. Cost: near-linear in the points.
void SharpenCorners(double spacing, WallCornerScratch& scratch, Rings& rings);

}  // namespace partiemc
