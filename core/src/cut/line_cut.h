// Cuts rings at a line parallel to an axis and keeps the part on one side.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// Marks that there is no ring, or no next chain.
inline constexpr std::uint32_t kNoSource = 0xffffffff;

/// A line parallel to an axis, and the side of it that is kept.
struct AxisLine {
  int axis = 0;  ///< The coordinate that is constant on the line: 0, 1 for x, y.
  double at = 0;
  bool keeps_above = true;  ///< Whether the kept points have larger coordinates than the line.
  /// Whether a segment and the reversed segment cross the line at the same point, bit for bit.
  bool is_shared = false;
};

struct LoopPoint {
  Point at;
  Point root;  ///< Its root (PlacedVertices::roots); equals `at` if it has none.
  float normal_x = 0, normal_y = 0;
  bool is_cut = false;  ///< The segment to the next point lies on a line at which a ring was cut.
  bool is_wet = false;  ///< The segment to the next point lies on a wall (Rings::wetted).
  float contact_angle = kNoContact;  ///< Rings::contact_angles; kNoContact if it is no contact.
  static constexpr float kNoContact = -1;
};

/// Closed polylines with the inside on the left.
struct Loops {
  struct Loop {
    std::uint32_t first = 0, last = 0;  ///< Its points, [first, last).
    std::uint32_t ring = kNoSource;     ///< The ring if the loop is a whole ring, else kNoSource.
    std::uint32_t outer = kNoSource;    ///< The outer ring of its component before the cut.
  };
  std::vector<LoopPoint> points;
  std::vector<Loop> loops;

  void Clear() {
    points.clear();
    loops.clear();
  }
};

/// Warm buffers of CutAtLine.
struct LineCutScratch {
  struct Crossing {
    double along;  // The coordinate on the line.
    std::uint32_t chain;
    bool is_entry;
  };
  struct Chain {
    std::uint32_t first, last;  // Its points in `points`, [first, last).
    std::uint32_t outer;
    std::uint32_t next;  // The chain that follows on the new loop; kNoSource once it is used.
  };
  std::vector<LoopPoint> points;
  std::vector<Chain> chains;
  std::vector<Crossing> crossings;
};

/// Appends to `kept` the parts of `loops` on the kept side of the line. Where a loop crosses the
/// line, new segments along the line close it (`is_cut`). Loops that do not cross the line stay as
/// they are, or are dropped.
///
/// Method: the line divides a loop into chains. The loops are simple, so along the line inside and
/// outside alternate between the crossings, in the order of their coordinates. Each stretch inside
/// joins the end of a chain to the beginning of a chain.
///
/// Returns false, with `kept` incomplete, if rounding leaves this order unknown: a point lies on
/// the line, two crossings have the same coordinate, or inside and outside do not alternate.
/// Requires: no two loops touch. Deterministic. Cost: linear in points, n log n in crossings.
[[nodiscard]] bool CutAtLine(const AxisLine& line, const Loops& loops, LineCutScratch& scratch,
                             Loops& kept);

}  // namespace partiemc
