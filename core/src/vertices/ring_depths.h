// How rings that do not cross lie in each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/point.h"
#include "base/sweep_status.h"
#include "partiemc/result.h"

namespace partiemc {

/// One sweep over rings, from below to above in the order of SweepsBefore. The line meets chains,
/// pieces of rings that only rise: they begin in pairs where a ring is lowest in its surroundings,
/// end in pairs where it is highest, and keep their order in between, as nothing crosses. Each
/// knows how often rings wind around what lies directly left of it. Keeps its memory warm from one
/// use to the next. Not safe to share between threads.
class RingDepths {
 public:
  /// Ring k has the points [offsets[k], offsets[k + 1]) of the interleaved `points`, and is closed
  /// by a segment from the last to the first. Requires: CountTouchingPairs of the rings is 0;
  /// coordinates in the domain of predicates.h. Exact. Cost: linear in the points, and n log n in
  /// the places where rings turn from falling to rising or back, of which a round ring has two.
  void Find(std::span<const double> points, std::span<const std::uint32_t> offsets);

  /// How often the others wind around ring k: +1 for each that runs counter-clockwise around it, -1
  /// for each that runs clockwise.
  std::int32_t DepthOf(std::size_t ring) const { return rings_[ring].depth; }
  /// The innermost of the rings around ring k, or kNoRing.
  std::uint32_t AroundOf(std::size_t ring) const { return rings_[ring].around; }

 private:
  // Where a ring turns from falling to rising, or back.
  struct Turn {
    Point point;
    std::uint32_t index;  // Of the point.
    std::uint32_t ring;
    bool is_low;
    bool is_lowest;  // Of its ring.
  };
  // A piece of a ring that rises from turn to turn.
  struct Chain {
    std::uint32_t ring;
    std::uint32_t at;           // Its last point that the line has passed.
    std::uint32_t first, last;  // The points [first, last) of its ring.
    bool goes_on;               // Rises as the ring runs; else against it.
    std::int32_t depth;         // Of what lies directly left of it.
  };

  struct Ring {
    std::int32_t depth = 0;
    std::uint32_t around = kNoRing;
    bool is_counter_clockwise = false;
  };

  static std::uint32_t Above(const Chain& chain);
  void CollectTurns(std::span<const std::uint32_t> offsets);
  bool RunsLeftOf(std::uint32_t chain, const Point& point);
  void Begin(const Turn& turn, std::span<const std::uint32_t> offsets);
  void End(const Turn& turn);

  std::span<const double> points_;
  std::vector<Ring> rings_;
  std::vector<Turn> turns_;
  std::vector<Chain> chains_;
  std::vector<std::uint32_t> unused_;
  SweepStatus status_;  // Of chains.
};

}  // namespace partiemc
