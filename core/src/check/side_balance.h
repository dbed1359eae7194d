// Whether directed sides cancel each other: how a mesh is shown to cover a region exactly.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <tuple>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// A multiset of directed sides. It is balanced if every stretch is run through as often one way as
/// the other. If the sides of counter-clockwise triangles, together with the boundary of a region
/// run backwards, are balanced, then each point lies in as many triangles as the boundary winds
/// round it: the triangles cover the region once and nothing else.
///
/// Sides may meet in T-junctions where they run along an axis, as those of merged lattice cells do;
/// others must match whole. Exact: coordinates are compared, never computed with.
/// Cost: n log n.
class SideBalance {
 public:
  struct Finding {
    /// A point where sides are not balanced, or nothing if they are.
    std::optional<Point> imbalance;
    /// Ends of sides that lie inside of others, where sides cancel only piece by piece. Counted if
    /// sides are balanced. None: every side cancels whole, hence is shared by two triangles, or by
    /// a triangle and the boundary.
    std::size_t t_junctions = 0;
    Point t_junction;  ///< One of them.

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

  /// What is wrong with the sides. Forgets them.
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

  /// A place on a line along an axis where sides begin or end.
  struct Step {
    bool is_horizontal;
    double line, position;
    int change;   // Of the sum of signs.
    int opening;  // How many sides begin here, less those that end.
  };

  static auto Place(const Side& side) {
    return std::tie(side.lower.y, side.lower.x, side.upper.y, side.upper.x);
  }
  static auto Place(const Step& step) {
    return std::tie(step.is_horizontal, step.line, step.position);
  }

  /// Turns what is left of sides along an axis into steps; returns the lower end of a slanted side
  /// of which something is left.
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

  /// Nothing is left on a line exactly when the changes at each of its places cancel. A place lies
  /// inside of the sides that are open before it and do not end there.
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
