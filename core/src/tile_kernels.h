// The inner loops of the field stage, over one tile, in the vectors of the processor at hand.
//
// Every target (tile_kernels.cc is compiled once for each) gives the same bits: a lane does what
// the scalar formula says, in the same order, without fused multiply-adds, and no sum runs across
// lanes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bins.h"
#include "cell_mask.h"
#include "lattice.h"
#include "scale.h"

namespace partiemc {

/// The list of one tile. `weight` is null where weights are uniform.
struct TileEntries {
  const BinEntry* entries;
  const float* weight;
  std::size_t count;
};

/// Sums at the nodes of a tile, with a margin that takes what kernels add beyond its sides: those
/// of a radius of up to half the margin are added without a look at where they end.
inline constexpr int kSumMargin = 8;
inline constexpr int kSumColumns = kTileSize + 2 * kSumMargin;
inline constexpr int SumIndex(int i, int j) {
  return (j + kSumMargin) * kSumColumns + i + kSumMargin;
}
/// Two rows more: particles that reach a tile's last cells only begin beyond its last node, and the
/// lanes of a vector may go on in the next row.
using NodeSums = std::array<float, (kTileSize + 2 * kSumMargin + 2) * kSumColumns>;

/// Kernel sums at the nodes of one tile. The moments are relative to the node, so that the mean
/// loses no digits where the tile's corner is far.
struct alignas(64) MomentSums {
  NodeSums kernel;    ///< sum k
  NodeSums moment_x;  ///< sum k (x_i - x)
  NodeSums moment_y;
  NodeSums xx;  ///< sum k (x_i - x)^2, and so on.
  NodeSums xy;
  NodeSums yy;
  NodeSums weighted;  ///< sum w k; only where weights differ from particle to particle.
};

/// sum k at every node, or sum w k where there are weights.
void ScatterKernel(const TileEntries& entries, float radius, NodeSums& sums);

/// All sums, of the entries in cells of `mask`, or of all where it is null.
void ScatterMoments(const TileEntries& entries, float radius, const CellMask* mask,
                    MomentSums& sums);

/// What the density f = weight * sum says of a tile's nodes: their sides, and the branch of F that
/// decides them; where f = 0, F itself.
void ClassifyNodes(const NodeSums& sums, float weight, const Scale& scale, float* values,
                   BitRows& sure_inside, BitRows& sure_outside);

}  // namespace partiemc
