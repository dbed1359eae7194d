// Visits the nodes or cells of a brick in small blocks. The particles around a block can then be
// collected once.
#pragma once

#include <bit>
#include <cstdint>

#include "space/lattice.h"

namespace partiemc::space {

/// Calls visit(i, j, k) for each marked node or cell of a brick, in blocks of 2 x 2 x 2. Finishes
/// each part of 4 x 4 x 4 before the next part. Before each block with marks, calls move_to(i, j,
/// k) with the lowest place of the block.
template <typename MoveTo, typename Visit>
void ForEachInBlocks(const BrickBits& marked, MoveTo move_to, Visit visit) {
  constexpr int kBlocks = 64;
  for (int block = 0; block < kBlocks; ++block) {
    // The bits of `block`: z, y, x of the part, then z, y, x of the block in the part.
    const auto along = [block](int axis) {
      return 4 * (block >> (3 + axis) & 1) + 2 * (block >> axis & 1);
    };
    const int i = along(0), j = along(1), k = along(2);
    constexpr std::uint64_t kSquare = 0x303;
    const std::uint64_t square = kSquare << (j * kBrickSize + i);
    if (((marked[k] | marked[k + 1]) & square) == 0) continue;
    move_to(i, j, k);
    for (int layer = k; layer < k + 2; ++layer) {
      for (std::uint64_t bits = marked[layer] & square; bits != 0; bits &= bits - 1) {
        const int bit = std::countr_zero(bits);
        visit(bit % kBrickSize, bit / kBrickSize, layer);
      }
    }
  }
}

}  // namespace partiemc::space
