// The parts of rings that are outline: without the segments on faces of a periodic box.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/result.h"

namespace partiemc::client {

/// Calls visit(ring, points, is_closed) for each stretch of the rings between cuts (Rings::cuts).
/// `points` has the indices of the points of the stretch, along the ring, at least two. A ring
/// without cuts is one closed stretch; its first point is not repeated.
template <typename Visit>
void ForEachStretch(const Rings& rings, const Visit& visit) {
  std::vector<std::uint32_t> points;
  auto cut = rings.cuts.begin();
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t first = rings.offsets[ring], last = rings.offsets[ring + 1];
    const auto end = std::lower_bound(cut, rings.cuts.end(), last);
    const std::span<const std::uint32_t> cuts(cut, end);
    cut = end;
    points.clear();
    // Begins after the last cut, so that a stretch over the end of the ring is in one piece.
    const std::uint32_t start = cuts.empty() ? first : cuts.back() + 1 - first;
    for (std::uint32_t k = 0; k < last - first; ++k) {
      const std::uint32_t point = cuts.empty() ? first + k : first + (start + k) % (last - first);
      points.push_back(point);
      if (cuts.empty() || !std::ranges::binary_search(cuts, point)) continue;
      if (points.size() > 1) visit(ring, std::span<const std::uint32_t>(points), false);
      points.clear();
    }
    if (cuts.empty()) visit(ring, std::span<const std::uint32_t>(points), true);
  }
}

}  // namespace partiemc::client
