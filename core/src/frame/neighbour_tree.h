// A k-d tree of points of the plane (Point) or of space (Vec3).
//
// An implicit balanced tree: the median of a range splits it, along the axes in turn.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "base/parallel.h"
#include "base/point.h"
#include "base/vec3.h"

namespace partiemc {

inline double Along(const Point& at, int axis) { return axis == 0 ? at.x : at.y; }
inline double Along(const Vec3& at, int axis) { return axis == 0 ? at.x : axis == 1 ? at.y : at.z; }
inline Point Difference(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y}; }
inline Vec3 Difference(const Vec3& a, const Vec3& b) { return a - b; }
inline double SquareOf(const Point& a) { return a.x * a.x + a.y * a.y; }
inline double SquareOf(const Vec3& a) { return Dot(a, a); }
/// The largest magnitude of a coordinate.
inline double LongestOf(const Point& a) { return std::max(std::abs(a.x), std::abs(a.y)); }
inline double LongestOf(const Vec3& a) {
  return std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)});
}
constexpr int AxisAfter(const Point&, int axis) { return 1 - axis; }
constexpr int AxisAfter(const Vec3&, int axis) { return axis == 2 ? 0 : axis + 1; }

/// Orders positions into a tree. Requires: they are distinct. Cost: n log n, parallel.
template <typename Place>
void BuildTree(std::span<Place> positions, int axis = 0) {
  if (positions.size() < 2) return;
  const std::size_t middle = positions.size() / 2;
  std::nth_element(
      positions.begin(), positions.begin() + middle, positions.end(),
      [axis](const Place& a, const Place& b) { return Along(a, axis) < Along(b, axis); });
  const int next = AxisAfter(Place{}, axis);
  const auto build_lower = [=] { BuildTree(positions.first(middle), next); };
  const auto build_upper = [=] { BuildTree(positions.subspan(middle + 1), next); };
  // Below this number of positions a task costs more than it saves.
  constexpr std::size_t kMinParallel = 1 << 13;
  if (positions.size() >= kMinParallel) {
    ParallelInvoke(build_lower, build_upper);
  } else {
    build_lower();
    build_upper();
  }
}

/// Calls near.Add(offset) for positions near `query`, also for `query` itself. The tree and `query`
/// determine the order. Skips branches farther than the square root of near.reach_square(), which
/// must not grow.
template <typename Place, typename Near>
void GatherNearest(std::span<const Place> tree, const Place& query, Near& near, int axis = 0) {
  if (tree.empty()) return;
  const std::size_t middle = tree.size() / 2;
  near.Add(Difference(tree[middle], query));
  const double across = Along(query, axis) - Along(tree[middle], axis);
  const auto lower = tree.first(middle);
  const auto upper = tree.subspan(middle + 1);
  const int next = AxisAfter(query, axis);
  GatherNearest(across < 0 ? lower : upper, query, near, next);
  if (across * across < near.reach_square()) {
    GatherNearest(across < 0 ? upper : lower, query, near, next);
  }
}

/// Calls visit(offset, count) for the positions in the square or cube with half the side `radius`
/// around a point, in the order of the tree. A branch of at most `group` positions counts as its
/// middle one, with `count` positions; other positions have the count 1. Ends and returns false as
/// soon as visit returns false.
template <typename Place, typename Visit>
bool VisitAround(std::span<const Place> tree, const Place& point, double radius, std::size_t group,
                 Visit& visit, int axis = 0) {
  if (tree.empty()) return true;
  const std::size_t middle = tree.size() / 2;
  const bool is_group = tree.size() <= group;
  const int next = AxisAfter(point, axis);
  const double across = Along(point, axis) - Along(tree[middle], axis);
  if (!is_group && across <= radius &&
      !VisitAround(tree.first(middle), point, radius, group, visit, next)) {
    return false;
  }
  const Place offset = Difference(tree[middle], point);
  if (LongestOf(offset) <= radius && !visit(offset, is_group ? tree.size() : 1)) return false;
  return is_group || !(across >= -radius) ||
         VisitAround(tree.subspan(middle + 1), point, radius, group, visit, next);
}

}  // namespace partiemc
