// Finds the nesting of rings that do not cross: the winding number and the ring around each ring.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/point.h"
#include "base/sweep_status.h"
#include "partiemc/result.h"

namespace partiemc {

/// Method: one sweep from bottom to top in the order of SweepsBefore. The sweep line crosses
/// chains: the pieces of a ring between a local minimum and a local maximum. Chains begin in pairs
/// at the local minima of a ring and end in pairs at its local maxima. In between, the order of the
/// chains on the line stays the same, because rings do not cross. Each chain stores the winding
/// number of the region directly left of it.
///
/// Find reuses the memory of the call before. Use one object per thread.
class RingDepths {
 public:
  /// Computes the nesting, exactly. Ring k has the points [offsets[k], offsets[k + 1]) of the
  /// interleaved `points`, and is closed by a segment from the last to the first.
  /// Requires: CountTouchingPairs of the rings is 0; coordinates in the domain of predicates.h.
  /// Cost: linear in the points; n log n in the local minima and maxima (a round ring has two).
  void Find(std::span<const double> points, std::span<const std::uint32_t> offsets);

  /// Winding number of the other rings around ring k: +1 for each counter-clockwise ring around it,
  /// -1 for each clockwise one.
  std::int32_t DepthOf(std::size_t ring) const { return rings_[ring].depth; }
  /// The innermost of the rings around ring k, or kNoRing.
  std::uint32_t AroundOf(std::size_t ring) const { return rings_[ring].around; }

 private:
  // A local minimum or maximum of a ring.
  struct Turn {
    Point point;
    std::uint32_t index;  // Index of the point.
    std::uint32_t ring;
    bool is_low;     // Whether the point is a minimum.
    bool is_lowest;  // Whether the point is the lowest of its ring.
  };
  // A rising piece of a ring, from a minimum to a maximum.
  struct Chain {
    std::uint32_t ring;
    std::uint32_t at;           // Highest point of the chain below the sweep line.
    std::uint32_t first, last;  // The ring has the points [first, last).
    bool is_forward;            // Whether the chain rises in the ring's direction.
    std::int32_t depth;         // Winding number directly left of the chain.
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
  SweepStatus status_;  // Chains from left to right.
};

}  // namespace partiemc
