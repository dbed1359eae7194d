// The inner loops of the field stage, over one tile, in the vectors of the processor at hand.
//
// Every target (tile_kernels.cc, moment_kernels.cc and scatter_kernels.cc are compiled once for
// each) gives the same bits: a lane does what the scalar formula says, in the same order, without
// fused multiply-adds, and no sum runs across lanes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "bins/bins.h"
#include "bins/lattice.h"
#include "bins/masked_particles.h"
#include "frame/scale.h"

namespace partiemc {

/// Sums at the nodes of a tile, with a margin that takes what kernels of its particles add beyond
/// its sides. Wider kernels than that are cut off at the tile's sides.
inline constexpr int kSumMargin = 8;
inline constexpr int kSumColumns = kTileSize + 2 * kSumMargin;
inline constexpr int SumIndex(int i, int j) {
  return (j + kSumMargin) * kSumColumns + i + kSumMargin;
}
/// Two rows more: the lanes of a vector may go on in the next row, and what is beyond the reach of
/// the last particle in the one after it.
using NodeSums = std::array<float, (kTileSize + 2 * kSumMargin + 2) * kSumColumns>;

/// A square of nodes of a tile, some of which are asked for moments.
///
///   12 13 14 15
///    8  9 10 11   Bit k of `asked` stands for node k, the first one is (column, row) of the tile.
///    4  5  6  7
///    0  1  2  3
struct NodeBlock {
  static constexpr int kSide = 4;
  static constexpr int kNodes = kSide * kSide;
  std::uint8_t column = 0, row = 0;
  std::uint16_t asked = 0;
};

/// Blocks that together have each asked node of a tile once, those of a row side by side.
struct NodeBlocks {
  static constexpr int kMost = kTileNodes / NodeBlock::kNodes;
  std::array<NodeBlock, kMost> blocks;
  int count = 0;

  const NodeBlock& operator[](int block) const { return blocks[block]; }
};

/// Rows and columns of blocks begin at the first asked node that none before them has.
NodeBlocks BlocksOf(const BitRows& asked);

/// Kernel sums at the nodes of one block. The moments are relative to the node, so that the mean
/// loses no digits where the tile's corner is far.
struct alignas(64) BlockSums {
  using Channel = std::array<float, NodeBlock::kNodes>;
  Channel kernel;    ///< sum k; only where the density does not tell it.
  Channel moment_x;  ///< sum k (x_i - x)
  Channel moment_y;
  Channel xx;  ///< sum k (x_i - x)^2, and so on.
  Channel xy;
  Channel yy;
};
using MomentSums = std::array<BlockSums, NodeBlocks::kMost>;

/// The nodes of a tile of which moments are asked.
struct AskedNodes {
  BitRows rows;
  bool is_open;          ///< Whether the density left their sides open, else it has decided them.
  bool has_kernel_sums;  ///< Whether their values so far are sum k (ClassifyNodes).
};

/// The list of one tile. `weight` is null where weights are uniform.
struct TileParticles {
  const BinnedParticle* particles;
  const float* weight;
  std::size_t count;
};

/// Adds the kernels of a tile's own particles to `sums`, times their weights where there are any,
/// also beyond the tile's sides. Requires: radius <= kSumMargin.
void ScatterKernels(const TileParticles& tile, float radius, NodeSums& sums);

/// The same of particles in and around a tile, to the tile's nodes only, for any radius. `weight`,
/// by particle of the bins, is null where weights are uniform.
void ScatterNearKernels(const ParticleBlock& near, const float* weight, float radius,
                        NodeSums& sums);

/// Adds to the moments at the nodes of blocks, particle after particle. `sum k` is added up unless
/// it is known.
void AddNearMoments(const ParticleBlock& near, float radius, const NodeBlocks& blocks,
                    bool has_kernel_sums, MomentSums& sums);

/// What the density f = weight * sum says of the nodes of a tile: those that are inside, those that
/// it leaves open, and, but for the latter, in place of the sums the branch of F that decides them;
/// where f = 0, F itself.
void ClassifyNodes(float weight, const Scale& scale, float* values, BitRows& inside, BitRows& open);

/// Sets the values of the asked nodes, as ClassifyNodes has left them, to F. Returns those of them
/// that are inside.
BitRows EvaluateNodes(const AskedNodes& asked, const NodeBlocks& blocks, const MomentSums& sums,
                      float weight, const Scale& scale, float* values);

}  // namespace partiemc
