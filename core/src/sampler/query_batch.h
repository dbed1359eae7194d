// Points that are near each other, collected so that the particles around them are looked up once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "bins/lattice.h"
#include "sampler/neighbour_query.h"

namespace partiemc {

/// Points of a tile, in cells relative to it: neighbours, which look at the same particles.
template <typename Member>
struct PointGroup {
  std::uint32_t tile = kNoTile;
  std::size_t count = 0;
  std::array<Member, kPointsAtOnce> points;
  std::array<std::size_t, kPointsAtOnce> vertices;  ///< What each belongs to.
};

/// Collects points of successive vertices of rings in groups, and hands each to a sink, a function
/// of const PointGroup<Member>&.
template <typename Member, typename Sink>
class QueryBatch {
 public:
  explicit QueryBatch(Sink sink) : sink_(sink) {}

  /// A point joins the group if that is of its tile and has room.
  void Add(std::size_t vertex, std::uint32_t tile, const Member& point) {
    if (group_.tile != tile || group_.count == kPointsAtOnce) {
      Part();
      group_.tile = tile;
    }
    group_.vertices[group_.count] = vertex;
    group_.points[group_.count++] = point;
  }

  /// What comes is in no group with what has come. Call it last, too.
  void Part() {
    if (group_.count > 0) sink_(std::as_const(group_));
    group_.count = 0;
  }

 private:
  Sink sink_;
  PointGroup<Member> group_;
};

/// Collects for `sink`.
template <typename Member, typename Sink>
QueryBatch<Member, Sink> CollectPoints(Sink sink) {
  return QueryBatch<Member, Sink>(sink);
}

/// Points of so many successive segments share a group. Those of more would lie so far apart that
/// each looks at too many of the others' particles.
inline constexpr std::size_t kSegmentsOfGroup = 4;
static_assert(2 * kSegmentsOfGroup <= kPointsAtOnce, "a segment has two points");

/// The segment with which the group of a segment begins, both by their index in the ring.
constexpr std::size_t BeginOfGroup(std::size_t segment) {
  return segment - segment % kSegmentsOfGroup;
}
constexpr bool BeginsGroup(std::size_t segment) { return BeginOfGroup(segment) == segment; }

}  // namespace partiemc
