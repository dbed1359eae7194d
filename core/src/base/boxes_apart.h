// Boxes along the axes, and which of many touch no other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// A box around points; around none at first.
struct Box {
  double left = std::numeric_limits<double>::infinity(), bottom = left, right = -left, top = -left;

  void Add(const Point& point) {
    left = std::min(left, point.x);
    bottom = std::min(bottom, point.y);
    right = std::max(right, point.x);
    top = std::max(top, point.y);
  }
};

/// Whether two boxes, borders included, have a point in common. Without a branch: of boxes that are
/// near each other, nobody guesses which of the four comparisons decides.
template <typename BoxA, typename BoxB>
bool BoxesTouch(const BoxA& a, const BoxB& b) {
  return static_cast<bool>(
      static_cast<int>(a.right >= b.left) & static_cast<int>(b.right >= a.left) &
      static_cast<int>(a.top >= b.bottom) & static_cast<int>(b.top >= a.bottom));
}

/// Buffers of FindBoxesApart.
struct BoxesApartScratch {
  std::vector<std::uint32_t> order, open;
};

/// Sets is_apart[k] to 1 only where boxes[k] touches none of the others. Boxes that lie above more
/// than a few dozen others may be called near, too, so that no heap of them takes long.
/// Cost: n log n.
void FindBoxesApart(std::span<const Box> boxes, BoxesApartScratch& scratch,
                    std::vector<std::uint8_t>& is_apart);

}  // namespace partiemc
