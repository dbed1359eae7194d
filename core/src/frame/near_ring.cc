#include "frame/near_ring.h"

#include <algorithm>

namespace partiemc {
namespace {

// The square lattice's diagonal is at 1.41, a little noise included.
constexpr double kMaxRatio = 1.6;

// Two offsets that span less than this (a sine) do not tell that the side between them is taken:
// the straight edge of a lattice, bent by noise, has everything on one side.
constexpr double kMinSine = 0.25;

}  // namespace

bool NearRing::IsAround() const {
  const double farthest = reach_square();
  if (!std::isfinite(farthest) || farthest > kMaxRatio * kMaxRatio * offsets_[1].square) {
    return false;
  }
  // Seen from each offset, another one comes within half a turn to its left.
  return std::all_of(offsets_.begin(), offsets_.end(), [&](const Offset& a) {
    return std::any_of(offsets_.begin(), offsets_.end(), [&](const Offset& b) {
      const double cross = a.x * b.y - a.y * b.x;
      return cross > 0 && cross * cross >= kMinSine * kMinSine * (a.square * b.square);
    });
  });
}

}  // namespace partiemc
