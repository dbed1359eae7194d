// Checks that the directed sides of triangles cancel, which proves that a mesh covers its region.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <tuple>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// A multiset of directed sides. The set is balanced if every piece of every side occurs equally
/// often in both directions.
///
/// Why balance proves a cover: add the sides of counter-clockwise triangles, and the boundary of a
/// region reversed. If the sides are balanced, the number of triangles around any point is the
/// winding number of the boundary. The triangles therefore cover the region once, and nothing
/// outside it.
///
/// Sides along an axis may meet in T-junctions, as the sides of merged lattice cells do. Slanted
/// sides must match as a whole. Exact: coordinates are only compared.
/// Cost: n log n.
class SideBalance {
 public:
  struct Finding {
    /// A point where the sides are not balanced, if there is one.
    std::optional<Point> imbalance;
    /// Number of points where a side ends inside another side, if the sides are balanced. If it is
    /// 0, each side belongs to two triangles, or to one triangle and the boundary.
    std::size_t t_junctions = 0;
    Point t_junction;  ///< One of these points.

    friend bool operator==(const Finding&, const Finding&) = default;
  };

  /// Requires: from != to.
  void Add(const Point& from, const Point& to) {
    if (SweepsBefore(from, to)) {
      sides_.push_back({from, to, 1});
    } else {
      sides_.push_back({to, from, -1});
    }
  }

  /// Checks the sides and clears them.
  Finding Take() {
    Finding finding;
    finding.imbalance = CancelWholeSides();
    sides_.clear();
    if (!finding.imbalance.has_value()) WalkSteps(finding);
    steps_.clear();
    return finding;
  }

 private:
  struct Side {
    Point lower, upper;
    int sign;  // +1 if it runs from `lower` to `upper`.
  };

  /// A position on an axis-parallel line where sides begin or end.
  struct Step {
    bool is_horizontal;
    double line, position;
    int change;   // Change of the sum of signs.
    int opening;  // Sides that begin here, minus sides that end here.
  };

  static auto Place(const Side& side) {
    return std::tie(side.lower.y, side.lower.x, side.upper.y, side.upper.x);
  }
  static auto Place(const Step& step) {
    return std::tie(step.is_horizontal, step.line, step.position);
  }

  /// Cancels equal sides. Turns the remaining axis-parallel sides into steps; returns the lower end
  /// of a remaining slanted side, if there is one.
  std::optional<Point> CancelWholeSides() {
    std::sort(sides_.begin(), sides_.end(),
              [](const Side& a, const Side& b) { return Place(a) < Place(b); });
    for (auto side = sides_.begin(); side != sides_.end();) {
      const auto [lower, upper, sign] = *side;
      int sum = 0;
      for (const auto first = side; side != sides_.end() && Place(*side) == Place(*first); ++side) {
        sum += side->sign;
      }
      if (sum == 0) continue;
      const bool is_horizontal = lower.y == upper.y;
      if (!is_horizontal && lower.x != upper.x) return lower;
      const double line = is_horizontal ? lower.y : lower.x;
      const int count = sum < 0 ? -sum : sum;
      steps_.push_back({is_horizontal, line, is_horizontal ? lower.x : lower.y, sum, count});
      steps_.push_back({is_horizontal, line, is_horizontal ? upper.x : upper.y, -sum, -count});
    }
    return std::nullopt;
  }

  /// Walks along each line. The sides on a line cancel if and only if the changes at each position
  /// sum to 0. A position lies inside the sides that begin before it and end after it.
  void WalkSteps(Finding& finding) {
    std::sort(steps_.begin(), steps_.end(),
              [](const Step& a, const Step& b) { return Place(a) < Place(b); });
    int open = 0;  // Back at 0 at the end of every line.
    for (auto step = steps_.begin(); step != steps_.end();) {
      const auto first = step;
      const Point place = first->is_horizontal ? Point{first->position, first->line}
                                               : Point{first->line, first->position};
      int sum = 0, begun = 0;
      for (; step != steps_.end() && Place(*step) == Place(*first); ++step) {
        sum += step->change;
        (step->opening > 0 ? begun : open) += step->opening;
      }
      if (sum != 0) {
        finding = {.imbalance = place};
        return;
      }
      if (open > 0 && finding.t_junctions++ == 0) finding.t_junction = place;
      open += begun;
    }
  }

  std::vector<Side> sides_;
  std::vector<Step> steps_;
};

}  // namespace partiemc
