#include "repair.h"

#include <algorithm>

#include "measure.h"
#include "parallel.h"
#include "predicates.h"

namespace partiemc {
namespace {

constexpr int kGentleRounds = 4;

Point PointAt(const Rings& rings, std::size_t k) {
  return {rings.points[2 * k], rings.points[2 * k + 1]};
}

// Marks both ends of a segment and the points before and after it.
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

RepairScratch::Box BoxOf(const Rings& rings, std::size_t ring) {
  const std::uint32_t first = rings.offsets[ring];
  const Point start = PointAt(rings, first);
  RepairScratch::Box box{start.x, start.x, start.y, start.y, first};
  for (std::uint32_t k = first + 1; k < rings.offsets[ring + 1]; ++k) {
    const Point point = PointAt(rings, k);
    if (point.x < box.x0 || (point.x == box.x0 && point.y < PointAt(rings, box.leftmost).y)) {
      box.leftmost = k;
    }
    box.x0 = std::min(box.x0, point.x);
    box.x1 = std::max(box.x1, point.x);
    box.y0 = std::min(box.y0, point.y);
    box.y1 = std::max(box.y1, point.y);
  }
  return box;
}

// How often a ring winds around a point that is not on it: +1 inside an outer ring, -1 in a hole.
int WindingNumber(const Rings& rings, std::size_t ring, const Point& point) {
  const std::uint32_t first = rings.offsets[ring];
  const std::uint32_t last = rings.offsets[ring + 1];
  int winding = 0;
  for (std::uint32_t k = first; k < last; ++k) {
    const Point a = PointAt(rings, k);
    const Point b = PointAt(rings, k + 1 == last ? first : k + 1);
    if ((a.y <= point.y) == (b.y <= point.y)) continue;
    const int side = Orientation(a, b, point);
    if (a.y <= point.y && side > 0) ++winding;
    if (a.y > point.y && side < 0) --winding;
  }
  return winding;
}

void MeasureRings(Rings& rings) {
  rings.measures.resize(rings.RingCount());
  ParallelFor(rings.RingCount(), [&](std::size_t ring) {
    rings.measures[ring] = MeasureRing(rings.RingPoints(ring));
  });
}

// Marks the rings that are turned inside out or lie on the wrong side of others, with those
// around them. Requires: rings were measured, and searched for pairs. Of rings that do not cross,
// one is in its place if and only if the others wind around its leftmost point as often as around
// the region outside of an outer ring (0), or around the fluid that a hole lies in (1). What
// touches no other ring's box has none around it, and is around none.
bool MarkMisplacedRings(const Rings& rings, RepairScratch& scratch) {
  const std::size_t count = rings.RingCount();
  bool has_found = false;
  scratch.boxes.resize(count);
  scratch.order.clear();
  for (std::uint32_t ring = 0; ring < count; ++ring) {
    const bool is_hole = rings.outer_of[ring] != kNoRing;
    if (scratch.pairs.is_apart[ring] == 0 || is_hole) {
      scratch.boxes[ring] = BoxOf(rings, ring);
      scratch.order.push_back(ring);
    } else if (rings.measures[ring].area < 0) {
      MarkRing(rings, ring, scratch.is_marked);
      has_found = true;
    }
  }
  std::sort(scratch.order.begin(), scratch.order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return scratch.boxes[a].x0 != scratch.boxes[b].x0 ? scratch.boxes[a].x0 < scratch.boxes[b].x0
                                                      : a < b;
  });
  scratch.open.clear();  // Rings that begin left of the sweep and end right of it.
  for (const std::uint32_t ring : scratch.order) {
    const Point point = PointAt(rings, scratch.boxes[ring].leftmost);
    std::erase_if(scratch.open,
                  [&](std::uint32_t other) { return scratch.boxes[other].x1 < point.x; });
    const auto is_around = [&](std::uint32_t other) {
      return scratch.boxes[other].y0 <= point.y && point.y <= scratch.boxes[other].y1;
    };
    int winding = 0;
    for (const std::uint32_t other : scratch.open) {
      if (is_around(other)) winding += WindingNumber(rings, other, point);
    }
    const bool is_hole = rings.outer_of[ring] != kNoRing;
    const bool is_turned = (rings.measures[ring].area < 0) != is_hole;
    if (is_turned || winding != (is_hole ? 1 : 0)) {
      has_found = true;
      MarkRing(rings, ring, scratch.is_marked);
      for (const std::uint32_t other : scratch.open) {
        if (is_around(other)) MarkRing(rings, other, scratch.is_marked);
      }
    }
    scratch.open.push_back(ring);
  }
  return has_found;
}

// Moves the marked points; returns whether any was not at its root yet.
bool Retreat(std::span<const double> roots, bool all_the_way, const RepairScratch& scratch,
             Rings& rings) {
  bool has_moved = false;
  for (std::size_t k = 0; k < rings.points.size(); ++k) {
    if (!scratch.is_marked[k / 2] || rings.points[k] == roots[k]) continue;
    rings.points[k] = all_the_way ? roots[k] : (rings.points[k] + roots[k]) / 2;
    has_moved = true;
  }
  return has_moved;
}

}  // namespace

void RepairRings(std::span<const double> roots, RepairScratch& scratch, Rings& rings) {
  for (int round = 0;; ++round) {
    // Only what the round before has marked may have moved.
    const std::size_t touching =
        round == 0 ? CountTouchingPairs(rings.points, rings.offsets, scratch.pairs)
                   : CountTouchingPairsAgain(rings.points, rings.offsets, scratch.is_marked,
                                             scratch.pairs);
    scratch.is_marked.assign(rings.PointCount(), 0);
    bool all_the_way = round >= kGentleRounds;
    if (touching > 0) {
      for (const auto& [first, second] : scratch.pairs.pairs) {
        MarkSegment(rings, first, scratch.is_marked);
        MarkSegment(rings, second, scratch.is_marked);
      }
    } else {
      MeasureRings(rings);
      if (!MarkMisplacedRings(rings, scratch)) return;
      all_the_way = true;
    }
    if (Retreat(roots, all_the_way, scratch, rings)) continue;
    // What is marked is at its roots already, so it is something else that is out of its place.
    std::fill(scratch.is_marked.begin(), scratch.is_marked.end(), std::uint8_t{1});
    if (!Retreat(roots, true, scratch, rings)) break;
  }
  MeasureRings(rings);
}

}  // namespace partiemc
