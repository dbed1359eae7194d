// Covers the interior cells with squares in which attributes are nearly linear.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "bins/lattice.h"
#include "mesh/node_vertices.h"
#include "mesh/rectangles.h"
#include "partiemc/result.h"

namespace partiemc {

/// A block of level l has 2^l cells along each side; the largest one is a tile.
inline constexpr int kBlockLevels = kTileShift + 1;

/// Attributes at the lattice nodes around the interior cells.
struct NodeAttributes {
  const NodeVertices& nodes;  ///< Numbered from 0.
  std::span<const AttributeValues> values;
  double tolerance;  ///< A fraction of each attribute's range over the nodes.
};

/// The blocks that cover the interior cells. Keeps its memory warm from frame to frame.
struct Blocks {
  using Levels = std::array<BitRows, kBlockLevels>;
  std::vector<Levels> at_least;  ///< By tile and level: the cells in blocks of at least this level.
  std::vector<Levels> linear;    ///< Scratch: cells of blocks in which all attributes are linear.
};

/// Covers the interior cells with disjoint blocks. The blocks are as large as two rules allow:
/// 1. Every component of an attribute, and the length of a vector, is linear enough. A mesh with
///    the nodes' values at the corners of blocks deviates from each node's value by at most the
///    tolerance, for any choice of diagonals.
/// 2. A block and its neighbours along an edge differ by at most one level. So only the middle of
///    an edge can be the corner of another block.
/// Deterministic. Parallel over tiles. Cost: linear in cells, times values and levels.
void FindBlocks(const TileDirectory& directory, std::span<const BitRows> interior,
                const NodeAttributes& attributes, Blocks& blocks);

/// Calls visit(CellRectangle) for each block, by tile.
template <typename Visit>
void ForEachBlock(const Blocks& blocks, Visit visit) {
  for (std::uint32_t tile = 0; tile < blocks.at_least.size(); ++tile) {
    const Blocks::Levels& levels = blocks.at_least[tile];
    for (int level = 0; level < kBlockLevels; ++level) {
      const int side = 1 << level;
      for (int j = 0; j < kTileSize; j += side) {
        // All rows of a block have the same bits.
        const std::uint32_t larger = level + 1 < kBlockLevels ? levels[level + 1][j] : 0;
        for (std::uint32_t row = levels[level][j] & ~larger; row != 0;) {
          const int i = std::countr_zero(row);
          visit(CellRectangle{{tile, i, j}, side, side});
          row &= side == kTileSize ? 0 : ~(((std::uint32_t{1} << side) - 1) << i);
        }
      }
    }
  }
}

}  // namespace partiemc
