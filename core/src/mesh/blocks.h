// Covers the interior cells with squares in which attributes are nearly linear.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "bins/bins.h"
#include "bins/lattice.h"
#include "mesh/node_vertices.h"
#include "mesh/rectangles.h"
#include "partiemc/frame.h"
#include "partiemc/result.h"

namespace partiemc {

/// Number of levels. A block of level l has 2^l cells along each side; the largest one is a tile.
inline constexpr int kBlockLevels = kTileShift + 1;

/// The attributes of a frame.
struct AttributeSource {
  const Frame& frame;
  const ParticleBins& bins;
  /// Interpolates all attributes to points in world units, interleaved. The result is valid until
  /// the next call.
  absl::FunctionRef<std::span<const AttributeValues>(std::span<const double>)> at_points;
  /// Largest error, a fraction of the attribute's range over the particles. The range of a vector
  /// is the range of the component that varies most.
  double tolerance;
};

/// The blocks that cover the interior cells. Reuses its memory.
struct Blocks {
  using Levels = std::array<BitRows, kBlockLevels>;
  std::vector<Levels> at_least;  ///< By tile and level: the cells in blocks of this level or more.
  // Scratch:
  /// By tile, level: cells in blocks of this level or more that meet rule 1 of FindBlocks.
  std::vector<Levels> linear;
  std::vector<std::uint32_t> window_of;  ///< By tile: its first window, if it has windows.
  std::vector<double> windows;           ///< Sums over the particles in windows of 4 x 4 cells.
  std::vector<double> tolerances;        ///< By component; also for the length of each vector.
  NodeVertices nodes;                    ///< Nodes of one level.
  std::vector<double> node_points;       ///< Positions of `nodes`.
};

/// Covers the interior cells with disjoint blocks. The blocks are as large as two rules allow:
/// 1. Every component of an attribute, and the length of a vector, is linear enough: interpolation
///    from the corners deviates by at most the tolerance. Blocks of up to 4 cells along a side are
///    tested at every node, for any choice of diagonals. Larger blocks are tested at the middles of
///    the block and its edges, and by the mean of the particles in each window of 4 x 4 cells.
/// 2. A block and its neighbours along an edge differ by at most one level. Therefore only the
///    middle of an edge can be the corner of another block.
/// Deterministic. Parallel over tiles. Cost: linear in the particles, times the values of each,
/// plus the interpolation to the tested nodes, which are few where attributes are smooth.
void FindBlocks(const TileDirectory& directory, std::span<const BitRows> interior, double cell_size,
                const AttributeSource& attributes, Blocks& blocks);

/// Calls visit(CellRectangle) for each block, by tile.
template <typename Visit>
void ForEachBlock(const Blocks& blocks, Visit visit) {
  for (std::uint32_t tile = 0; tile < blocks.at_least.size(); ++tile) {
    const Blocks::Levels& levels = blocks.at_least[tile];
    for (int level = 0; level < kBlockLevels; ++level) {
      const int side = 1 << level;
      for (int j = 0; j < kTileSize; j += side) {
        // All rows of a block have the same bits, so its first row is enough.
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
