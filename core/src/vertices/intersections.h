// Finds the pairs of segments of closed polylines that cross or touch.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/box.h"

namespace partiemc {

/// Output and warm buffers of CountTouchingPairs. Memory: about 10 bytes for each segment, and 8
/// for each pair. A segment has the index of its first point.
struct TouchingPairsBuffers {
  /// Successive segments of a ring.
  struct Run {
    Box box;                             // Box of the segments.
    std::uint32_t first, last;           // Segments [first, last).
    std::uint32_t ring_begin, ring_end;  // The ring has the points [ring_begin, ring_end).
    std::uint8_t directions = 0;         // Bits of the directions that all its segments share.
  };
  /// Successive runs of a ring.
  struct Block {
    Box box;                      // Box of the runs.
    std::uint32_t first_run = 0;  // Runs [first_run, last_run).
    std::uint32_t last_run = 0;
    std::uint64_t cell = 0;          // Key of its cell in the grid of its level.
    std::uint32_t next_in_slot = 0;  // Next block of the same slot.
    std::uint8_t level = 0;          // Level of its grid.
    bool finds_pair = false;         // Whether the search from this block finds a pair.
  };
  std::vector<Run> runs;
  std::vector<Block> blocks;
  std::vector<std::uint32_t> slots;

  /// The pairs, as indices of segments. The number of pairs is at most the number of all segments;
  /// further pairs are counted but not stored.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
};

/// Counts the pairs of segments, over all rings, that have a point in common. Exact. Lists them in
/// `buffers.pairs`, but no more pairs than there are segments.
///
/// Ring k has the points [ring_offsets[k], ring_offsets[k + 1]) of the interleaved `points`, and is
/// closed by a segment from its last point to its first. Successive segments of a ring share a
/// point by construction. Such pairs count only if they overlap in more than this point, where the
/// ring folds back.
///
/// Requires: offsets ascend from 0 to points.size() / 2; coordinates in the domain of predicates.h.
/// Allocates nothing for an input no larger than an earlier one.
/// Cost: near-linear if few segments are close to each other compared with their length, as on
/// contours; quadratic at worst, if most boxes of segments overlap.
std::size_t CountTouchingPairs(std::span<const double> points,
                               std::span<const std::uint32_t> ring_offsets,
                               TouchingPairsBuffers& buffers);

}  // namespace partiemc
