// The inner loops of the field stage over one tile, in vectors.
//
// Every instruction set gives the same bits (tile_kernels.cc, moment_kernels.cc and
// scatter_kernels.cc are compiled once for each). A lane evaluates the scalar formula in the same
// order without fused multiply-adds, and no sum runs across lanes.
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

/// Margin of the sums of a tile, in nodes. If the kernel radius is at most this margin, a tile sums
/// the whole kernels of its particles, also beyond its sides. Wider kernels are cut at the sides of
/// tiles, and each tile sums the pieces on its nodes.
inline constexpr int kSumMargin = 8;
inline constexpr int kSumColumns = kTileSize + 2 * kSumMargin;
inline constexpr int SumIndex(int i, int j) {
  return (j + kSumMargin) * kSumColumns + i + kSumMargin;
}
/// Two extra rows: a vector may write beyond the end of the last row, and kernels are written in
/// pairs of rows, which may exceed their reach by one row.
using NodeSums = std::array<float, (kTileSize + 2 * kSumMargin + 2) * kSumColumns>;

/// A square of 4 x 4 nodes of a tile. The nodes in `asked` need moments.
///
///   12 13 14 15
///    8  9 10 11   Bit k of `asked` is node k. Node 0 is node (column, row) of the tile.
///    4  5  6  7
///    0  1  2  3
struct NodeBlock {
  static constexpr int kSide = 4;
  static constexpr int kNodes = kSide * kSide;
  std::uint8_t column = 0, row = 0;
  std::uint16_t asked = 0;
};

/// Blocks, by row, that together contain each requested node of a tile once.
struct NodeBlocks {
  static constexpr int kMost = kTileNodes / NodeBlock::kNodes;
  std::array<NodeBlock, kMost> blocks;
  int count = 0;

  const NodeBlock& operator[](int block) const { return blocks[block]; }
};

/// Finds the blocks for the requested nodes `asked`. Greedy, not minimal.
NodeBlocks BlocksOf(const BitRows& asked);

/// Kernel sums at the nodes of one block. Moments are relative to the node, so that the mean loses
/// no digits far from the corner of the tile. With sizes q, x_i - x is divided by q_i.
struct alignas(64) BlockSums {
  using Channel = std::array<float, NodeBlock::kNodes>;
  Channel kernel;    ///< sum k; unused if the density gives it.
  Channel moment_x;  ///< sum k (x_i - x)
  Channel moment_y;
  Channel xx;  ///< sum k (x_i - x)^2, and so on.
  Channel xy;
  Channel yy;
  Channel size;  ///< sum k q; 0 if sizes are equal.
};
using MomentSums = std::array<BlockSums, NodeBlocks::kMost>;

/// By block and node: the distance to the nearest surface of a grain, in cells; negative inside.
struct alignas(64) GrainDistances {
  std::array<BlockSums::Channel, NodeBlocks::kMost> blocks;
};

/// The requested nodes of a tile: those that need moments.
struct AskedNodes {
  BitRows rows;
  bool is_open;          ///< The density does not decide the sides of these nodes.
  bool has_kernel_sums;  ///< The values of these nodes are sum k (ClassifyNodes).
};

/// The particles of one tile. `weight` is null if weights are uniform or sizes differ, `size` if
/// sizes are equal.
struct TileParticles {
  const BinnedParticle* particles;
  const float* weight;
  const float* size;  ///< A particle's kernel radius is `radius` times its size.
  std::size_t count;
};

/// Adds the kernels of a tile's own particles to `sums`, including the margin; times their weights
/// if `tile.weight` is not null. Requires: the largest kernel radius is at most kSumMargin.
void ScatterKernels(const TileParticles& tile, float radius, NodeSums& sums);

/// Adds the kernels of particles in and around a tile to the tile's own nodes, for any radius.
/// `weight`: by particle of the bins, null if uniform.
void ScatterNearKernels(const ParticleBlock& near, const float* weight, float radius,
                        NodeSums& sums);

/// As ScatterNearKernels, for particles of different sizes.
void ScatterNearSizedKernels(const ParticleBlock& near, float radius, NodeSums& sums);

/// Adds particles, in their order, to the moments of blocks. `has_sizes`: sizes differ.
/// `has_kernel_sums`: sum k is known, so it is not added.
void AddNearMoments(const ParticleBlock& near, bool has_sizes, float radius,
                    const NodeBlocks& blocks, bool has_kernel_sums, MomentSums& sums);

/// Lowers `distances` to the distances from these grains, if they are nearer. Grains whose kernels
/// do not reach a node may be left out.
void AddNearGrains(const ParticleBlock& near, const Scale& scale, const NodeBlocks& blocks,
                   GrainDistances& distances);

/// Classifies the nodes of a tile by the density f = weight * sum. Sets `inside`, and `open` for
/// undecided nodes. Replaces the sums of decided nodes by the term of F that decides, or by F
/// itself if f = 0.
void ClassifyNodes(float weight, const Scale& scale, float* values, BitRows& inside, BitRows& open);

/// Replaces the requested values, which ClassifyNodes has set, by F; if sizes differ, by F times
/// the local size. Returns the requested nodes that are inside.
BitRows EvaluateNodes(const AskedNodes& asked, const NodeBlocks& blocks, const MomentSums& sums,
                      float weight, const Scale& scale, float* values);

}  // namespace partiemc
