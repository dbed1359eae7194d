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

#include "bins.h"
#include "lattice.h"
#include "near_entries.h"
#include "scale.h"

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

/// Kernel sums at the nodes of one tile. The moments are relative to the node, so that the mean
/// loses no digits where the tile's corner is far.
struct alignas(64) MomentSums {
  NodeSums kernel;    ///< sum k; only where the density does not tell it.
  NodeSums moment_x;  ///< sum k (x_i - x)
  NodeSums moment_y;
  NodeSums xx;  ///< sum k (x_i - x)^2, and so on.
  NodeSums xy;
  NodeSums yy;
};

/// The nodes of a tile of which moments are asked.
struct AskedNodes {
  BitRows rows;
  bool is_open;          ///< Whether the density left their sides open, else it has decided them.
  bool has_kernel_sums;  ///< Whether their values so far are sum k (ClassifyNodes).
};

/// In which rows of a tile kernels of a radius find asked nodes.
struct AskedColumns {
  /// By first column of a kernel, 0 for those before the tile: the rows that have asked nodes in
  /// the columns that it covers.
  BitRows rows;
  int span;  ///< Rows and columns of a kernel.

  /// Most rows of the tile that a kernel reaches.
  int MaxRows() const { return std::min(span, kTileSize); }
};
AskedColumns ColumnsOf(const AskedNodes& asked, float radius);

/// The list of one tile. `weight` is null where weights are uniform.
struct TileEntries {
  const BinEntry* entries;
  const float* weight;
  std::size_t count;
};

/// Adds the kernels of a tile's own particles to `sums`, times their weights where there are any:
/// also beyond the tile's sides. Returns the rows that they reach, those beyond the sides too.
/// Requires: there are particles, radius <= kSumMargin.
NodeRange ScatterKernels(const TileEntries& entries, float radius, NodeSums& sums);

/// The same of particles in and around a tile, to the tile's nodes only, for any radius. `weight`,
/// by entry of the bins, is null where weights are uniform.
void ScatterNearKernels(const NearEntries& near, const float* weight, float radius, NodeSums& sums);

/// Adds to the moments at the asked nodes; those at other nodes of the tile are anything. The sums
/// must be cleared first. `sum k` is added up unless it is known. Particles that reach asked nodes
/// in fewer rows come first, those of as many in their order.
void ScatterNearMoments(const NearEntries& near, float radius, const AskedColumns& asked,
                        bool has_kernel_sums, MomentSums& sums);
void ClearMoments(const AskedNodes& asked, MomentSums& sums);

/// What the density f = weight * sum says of the nodes in some rows of a tile: those that are
/// inside, those that it leaves open, and, but for the latter, in place of the sums the branch of F
/// that decides them; where f = 0, F itself.
void ClassifyNodes(float weight, const Scale& scale, NodeRange rows, float* values, BitRows& inside,
                   BitRows& open);

/// Sets the values of the asked nodes, as ClassifyNodes has left them, to F. Returns those of them
/// that are inside.
BitRows EvaluateNodes(const AskedNodes& asked, const MomentSums& sums, float weight,
                      const Scale& scale, float* values);

}  // namespace partiemc
