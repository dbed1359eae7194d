// Points that are near each other, collected so that the particles around them are looked up once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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

/// Collects points of successive vertices of rings in groups, and hands on kQueriesAtOnce groups at
/// a time to a sink, a function of std::span<const PointGroup<Member>>. Which points share a group
/// depends on what is added between two calls of Part alone, not on when groups are handed on.
template <typename Member, typename Sink>
class QueryBatch {
 public:
  explicit QueryBatch(Sink sink) : sink_(sink) {}

  /// What comes is in no group with what has come.
  void Part() { is_open_ = false; }

  /// A point joins the last group if that is of its tile and has room.
  void Add(std::size_t vertex, std::uint32_t tile, const Member& point) {
    if (!is_open_ || groups_[count_ - 1].tile != tile ||
        groups_[count_ - 1].count == kPointsAtOnce) {
      if (count_ == groups_.size()) HandOn();
      groups_[count_].tile = tile;
      groups_[count_++].count = 0;
      is_open_ = true;
    }
    PointGroup<Member>& group = groups_[count_ - 1];
    group.vertices[group.count] = vertex;
    group.points[group.count++] = point;
  }

  /// Hands on what is left. Call it last.
  void Finish() {
    if (count_ > 0) HandOn();
  }

 private:
  void HandOn() {
    sink_(std::span<const PointGroup<Member>>(groups_).first(count_));
    count_ = 0;
    is_open_ = false;
  }

  Sink sink_;
  std::array<PointGroup<Member>, kQueriesAtOnce> groups_;
  std::size_t count_ = 0;
  bool is_open_ = false;
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
