// Axis-aligned boxes.
#pragma once

#include <algorithm>
#include <limits>

#include "base/point.h"

namespace partiemc {

/// The bounding box of the added points; empty at first.
struct Box {
  double left = std::numeric_limits<double>::infinity(), bottom = left, right = -left, top = -left;

  void Add(const Point& point) {
    left = std::min(left, point.x);
    bottom = std::min(bottom, point.y);
    right = std::max(right, point.x);
    top = std::max(top, point.y);
  }
  double Extent() const { return std::max(right - left, top - bottom); }
};

/// Whether two closed boxes intersect. Branch-free, because branches would be unpredictable.
inline bool BoxesTouch(const Box& a, const Box& b) {
  return static_cast<bool>(
      static_cast<int>(a.right >= b.left) & static_cast<int>(b.right >= a.left) &
      static_cast<int>(a.top >= b.bottom) & static_cast<int>(b.top >= a.bottom));
}

}  // namespace partiemc
