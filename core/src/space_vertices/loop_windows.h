// The window of a loop: the loops within a distance that are connected with it through loops within
// the same distance.
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
  /// Most loops of a window: the first ones that the search reaches. This bounds the memory if
  /// cells are small.
  static constexpr std::size_t kMostLoopsOfWindow = 320;
  /// Loops per task.
  static constexpr std::size_t kLoopsAtOnce = 256;

  /// The windows of kLoopsAtOnce loops, each with its own loop first.
  struct Chunk {
    std::vector<std::uint32_t> first, loops;
    std::vector<std::uint32_t> slots;  ///< Scratch: open addressing.
  };
  std::vector<Chunk> chunks;  ///< The first ones are in use; later ones keep their memory.
  std::size_t loop_count = 0;

  std::vector<std::uint32_t> link_first, links;  ///< By loop: loops across its faces.

  std::size_t ChunkCount() const { return (loop_count + kLoopsAtOnce - 1) / kLoopsAtOnce; }
  std::span<const std::uint32_t> Of(std::size_t loop) const {
    const Chunk& chunk = chunks[loop / kLoopsAtOnce];
    const std::size_t at = loop % kLoopsAtOnce;
    return std::span(chunk.loops).subspan(chunk.first[at], chunk.first[at + 1] - chunk.first[at]);
  }
};

/// Finds the window of each loop, the loops within `reach` cells. `centres` by loop. Deterministic,
/// parallel over loops. Cost: linear in the sizes of the windows.
void FindWindows(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                 std::span<const Vec3> centres, double reach, LoopWindows& windows);

}  // namespace partiemc::space
