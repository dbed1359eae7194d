#include "vertices/repair.h"

#include <algorithm>

#include "base/cancellation.h"
#include "base/predicates.h"
#include "vertices/measure.h"

namespace partiemc {
namespace {

// After this number of rounds all points return at once, because adversarial frames could need a
// round for every few points. Ordinary frames need none; hostile test frames need up to nine.
constexpr int kMostRounds = 24;

// If a round has more misplaced rings than this, all rings return. Hardly any frame has even one.
constexpr std::size_t kMostMisplaced = 100;

// Marks both ends of a segment, and the point before and the point after it.
void MarkSegment(const Rings& rings, std::uint32_t segment, std::vector<std::uint8_t>& is_marked) {
  const auto after = std::upper_bound(rings.offsets.begin(), rings.offsets.end(), segment);
  const std::uint32_t begin = *(after - 1);
  const std::uint32_t count = *after - begin;
  for (std::uint32_t k = 0; k < 4; ++k) {
    is_marked[begin + (segment - begin + count - 1 + k) % count] = 1;
  }
}

void MarkRing(const Rings& rings, std::size_t ring, std::vector<std::uint8_t>& is_marked) {
  std::fill(is_marked.begin() + rings.offsets[ring], is_marked.begin() + rings.offsets[ring + 1],
            std::uint8_t{1});
}

Box BoxOf(const Rings& rings, std::size_t ring) {
  Box box;
  for (std::uint32_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
    box.Add(PointAt(rings.points, k));
  }
  return box;
}

// The point with the smallest x; among several, the lowest.
Point LeftmostOf(const Rings& rings, std::size_t ring) {
  Point leftmost = PointAt(rings.points, rings.offsets[ring]);
  for (std::uint32_t k = rings.offsets[ring] + 1; k < rings.offsets[ring + 1]; ++k) {
    const Point point = PointAt(rings.points, k);
    if (point.x < leftmost.x || (point.x == leftmost.x && point.y < leftmost.y)) leftmost = point;
  }
  return leftmost;
}

// Lists the misplaced rings: outer rings around which the winding number of the other rings is not
// 0, holes around which it is not 1, and rings turned inside out.
// Requires: rings were measured, and do not cross.
void FindMisplacedRings(const Rings& rings, RepairScratch& scratch) {
  scratch.misplaced.clear();
  scratch.ring_depths.Find(rings.points, rings.offsets);
  for (std::uint32_t ring = 0; ring < rings.RingCount(); ++ring) {
    const bool is_hole = rings.outer_of[ring] != kNoRing;
    const bool is_turned = (rings.measures[ring].area < 0) != is_hole;
    if (is_turned || scratch.ring_depths.DepthOf(ring) != (is_hole ? 1 : 0))
      scratch.misplaced.push_back(ring);
  }
}

// Marks each misplaced ring and the rings that may surround it: their boxes begin farther left and
// hold its leftmost point. Marks all rings if many are misplaced, because each misplaced ring is
// compared with all rings.
void MarkMisplacedRings(const Rings& rings, RepairScratch& scratch) {
  if (scratch.misplaced.size() > kMostMisplaced) {
    std::fill(scratch.is_marked.begin(), scratch.is_marked.end(), std::uint8_t{1});
    return;
  }
  scratch.leftmost.clear();
  for (const std::uint32_t ring : scratch.misplaced) {
    MarkRing(rings, ring, scratch.is_marked);
    scratch.leftmost.push_back(LeftmostOf(rings, ring));
  }
  if (scratch.misplaced.empty()) return;
  for (std::uint32_t other = 0; other < rings.RingCount(); ++other) {
    const Box box = BoxOf(rings, other);
    for (std::size_t k = 0; k < scratch.misplaced.size(); ++k) {
      const Point& point = scratch.leftmost[k];
      // Among rings with equal left sides, the ring with the lower number begins first.
      const bool begins_before =
          box.left != point.x ? box.left < point.x : other < scratch.misplaced[k];
      if (!begins_before || point.x > box.right || point.y < box.bottom || point.y > box.top) {
        continue;
      }
      MarkRing(rings, other, scratch.is_marked);
      break;
    }
  }
}

// Moves the marked points towards their roots; returns whether any point moved.
bool MovePoints(std::span<const double> roots, std::span<const std::uint8_t> near_walls,
                bool all_the_way, const RepairScratch& scratch, Rings& rings) {
  bool has_moved = false;
  for (std::size_t k = 0; k < rings.points.size(); ++k) {
    if (!scratch.is_marked[k / 2] || rings.points[k] == roots[k]) continue;
    const bool goes_back = all_the_way || (!near_walls.empty() && near_walls[k / 2] != 0);
    rings.points[k] = goes_back ? roots[k] : (rings.points[k] + roots[k]) / 2;
    has_moved = true;
  }
  return has_moved;
}

}  // namespace

bool RepairRings(std::span<const double> roots, std::span<const std::uint8_t> near_walls,
                 RepairScratch& scratch, Rings& rings) {
  for (int round = 0;; ++round) {
    ThrowIfCancelled();
    const std::size_t touching = CountTouchingPairs(rings.points, rings.offsets, scratch.pairs);
    scratch.is_marked.assign(rings.PointCount(), 0);
    bool all_the_way = round >= kHalfWayRounds;
    if (touching > 0) {
      for (const auto& [first, second] : scratch.pairs.pairs) {
        MarkSegment(rings, first, scratch.is_marked);
        MarkSegment(rings, second, scratch.is_marked);
      }
    } else {
      MeasureRings(rings);
      FindMisplacedRings(rings, scratch);
      if (scratch.misplaced.empty()) return true;
      MarkMisplacedRings(rings, scratch);
      all_the_way = true;
    }
    if (round < kMostRounds && MovePoints(roots, near_walls, all_the_way, scratch, rings)) continue;
    // All points return. Either the rounds are used up, or every marked point is at its root
    // already, so an unmarked point must move.
    std::fill(scratch.is_marked.begin(), scratch.is_marked.end(), std::uint8_t{1});
    if (!MovePoints(roots, near_walls, true, scratch, rings)) return false;
  }
}

}  // namespace partiemc
