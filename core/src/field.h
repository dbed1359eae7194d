// Stage 2 of 7: particles -> level set at every node (paper, Eq. 1-5).
#pragma once

#include <array>
#include <vector>

#include "bins.h"
#include "lattice.h"
#include "scale.h"

namespace partiemc {

/// The level set with its guard, F = max(|x - xbar| - r, (g - f) R / 1.164), in cells: negative
/// inside. Node (i, j) of a tile is value j * 32 + i.
struct LevelSet {
  std::vector<std::array<float, kTileNodes>> tiles;
  float void_value = 0;  ///< F where no particle reaches, hence in tiles that do not exist.

  /// F at the node (i, j) of `tile`, 0 <= i, j <= 32: the last row and column are the neighbours'.
  float At(const TileDirectory& directory, std::uint32_t tile, int i, int j) const {
    if (i < kTileSize && j < kTileSize) return tiles[tile][j * kTileSize + i];
    const TilePlace place = Normalise(directory, tile, i, j);
    return place.tile == kNoTile ? void_value : tiles[place.tile][place.j * kTileSize + place.i];
  }
};

/// Samples F at every node of every tile of `bins`.
/// Accuracy: 1e-5 relative to f = 1 for f, for nodes and particles as rounded by the bins.
/// Deterministic: each node's sums run over its tile's list in order, whatever the threads.
/// Cost: linear in the entries of the bins, times the square of the kernel radius in cells.
void SampleField(const ParticleBins& bins, const Scale& scale, LevelSet& level_set);

}  // namespace partiemc
