// Counts where closed polylines cross or touch, themselves or each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/box.h"

namespace partiemc {

/// Buffers of CountTouchingPairs, kept warm from call to call; they carry nothing from one to the
/// next. Memory: about 10 bytes per segment, whatever the input.
struct TouchingPairsBuffers {
  /// Successive segments of a ring, each named by the point that it begins at.
  struct Run {
    Box box;                             // Around them.
    std::uint32_t first, last;           // Segments [first, last),
    std::uint32_t ring_begin, ring_end;  // of a ring of [ring_begin, ring_end).
    std::uint8_t directions = 0;         // In which all of its segments go (intersections.cc).
  };
  /// Successive runs of a ring.
  struct Block {
    Box box;                      // Around them.
    std::uint32_t first_run = 0;  // Runs [first_run, last_run).
    std::uint32_t last_run = 0;
    std::uint64_t cell = 0;          // Where it lies in the grid of its size.
    std::uint32_t next_in_slot = 0;  // A list of blocks whose cells share a slot.
    std::uint8_t level = 0;          // Of its grid (intersections.cc).
    bool finds_pair = false;         // Whether it is the earlier one of a pair that counts.
  };
  std::vector<Run> runs;
  std::vector<Block> blocks;
  std::vector<std::uint32_t> slots;

  /// Pairs that were counted, each segment named by the point that it begins at. At most as many as
  /// there are segments; a frame with more of them has lost the later ones.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
};

/// The number of pairs of segments that have a point in common, over all segments of all rings.
/// Ring k has the points [ring_offsets[k], ring_offsets[k + 1]) of the interleaved `points` and is
/// closed by a segment from its last point to its first. Segments that follow each other on a ring
/// have their common end in common anyway: they count only if they overlap (the ring folds back).
/// Exact, by SegmentsTouch.
///
/// Requires: offsets ascend from 0 to points.size() / 2; coordinates in the domain of predicates.h.
/// Allocates nothing for an input no larger than one that `buffers` has seen.
/// Cost: near-linear when few segments are near each other compared to their length, as on
/// contours; quadratic at worst, when most boxes around segments of like size overlap.
std::size_t CountTouchingPairs(std::span<const double> points,
                               std::span<const std::uint32_t> ring_offsets,
                               TouchingPairsBuffers& buffers);

}  // namespace partiemc
