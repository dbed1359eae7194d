// Groups nearby points, so that their particles are looked up once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "bins/lattice.h"
#include "sampler/neighbour_query.h"

namespace partiemc {

/// Neighbouring points of a tile, in cells relative to the tile. They share their particles.
template <typename Member>
struct PointGroup {
  std::uint32_t tile = kNoTile;
  std::size_t count = 0;
  std::array<Member, kPointsAtOnce> points;
  std::array<std::size_t, kPointsAtOnce> vertices;  ///< By point: its vertex.
};

/// Collects points of consecutive vertices in groups. Passes up to kQueriesAtOnce groups at a time
/// to a sink, a function of std::span<const PointGroup<Member>>. The points between two calls of
/// Part are grouped regardless of all other points, so samples do not depend on how groups are
/// passed on.
template <typename Member, typename Sink>
class QueryBatch {
 public:
  explicit QueryBatch(Sink sink) : sink_(sink) {}

  /// Ends the last group: later points begin another group.
  void Part() { is_open_ = false; }

  /// Adds a point. The point joins the last group if that group has the same tile and is not full.
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

  /// Passes on the remaining groups. Call it last.
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

template <typename Member, typename Sink>
QueryBatch<Member, Sink> CollectPoints(Sink sink) {
  return QueryBatch<Member, Sink>(sink);
}

/// Most consecutive segments whose points share a group. With more segments, each point would visit
/// too many particles that only the other points need.
inline constexpr std::size_t kSegmentsOfGroup = 4;
static_assert(2 * kSegmentsOfGroup <= kPointsAtOnce, "a segment has two points");

/// The first segment of a segment's group. Both are indices in the ring.
constexpr std::size_t BeginOfGroup(std::size_t segment) {
  return segment - segment % kSegmentsOfGroup;
}
constexpr bool BeginsGroup(std::size_t segment) { return BeginOfGroup(segment) == segment; }

}  // namespace partiemc
