// The window of a loop: all loops that a walk along links reaches from it without leaving a given
// distance around it.
//
// A loop is the index of a vertex in a cell, minus `edge_count`. Two loops are linked if a curve on
// a face belongs to both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/crossings.h"
#include "space/lattice.h"

namespace partiemc::space {

struct LoopWindows {
  static constexpr std::uint32_t kMostLoopsOfChunk = 64;
  /// Limit of the number of loops near a chunk, which bounds the memory if cells are small. The
  /// loops with the fewest links to the chunk are kept; windows lack the others.
  static constexpr std::size_t kMostNear = 2048;

  static constexpr std::size_t kWordBits = 32;

  /// The windows of consecutive loops of a brick, as bits for the loops near the chunk.
  struct Chunk {
    std::uint32_t begin = 0, end = 0;  ///< The loops.
    std::vector<std::uint32_t> near;   ///< All loops in the windows, and some others; sorted.
    std::vector<std::uint32_t> bits;   ///< By loop: bit k % 32 of word k / 32 is loop near[k].
    std::vector<std::uint16_t> self;   ///< By loop: its index in `near`.

    std::size_t Words() const { return (near.size() + kWordBits - 1) / kWordBits; }
    std::span<const std::uint32_t> Of(std::uint32_t loop) const {
      return std::span(bits).subspan((loop - begin) * Words(), Words());
    }
  };
  std::vector<Chunk> chunks;  ///< The first `chunk_count` are in use; others keep their memory.
  std::size_t chunk_count = 0;

  std::vector<std::uint32_t> links;  ///< By step of SpaceCrossings: the loop across its face.
};

/// Finds the window of each loop for the distance `reach`, in cells, times its local size.
/// `centres` and `sizes` are by loop; no sizes: all are 1. Deterministic, parallel over chunks.
/// Cost: linear in the sizes of the windows.
void FindWindows(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                 std::span<const Vec3> centres, double reach, LoopWindows& windows,
                 std::span<const float> sizes = {});

}  // namespace partiemc::space
