// Stage 2 of 9: particles -> level set at every node (paper, Eq. 1-5).
#pragma once

#include <array>
#include <vector>

#include "bins/bins.h"
#include "bins/lattice.h"
#include "field/density_halo.h"
#include "frame/scale.h"

namespace partiemc {

/// The level set F (level_set_formula.h), in cells: negative inside. Node (i, j) of a tile is value
/// j * 32 + i.
///
/// Values are exact at both ends of every lattice edge that the isoline crosses. Anywhere else only
/// the sign is F's: where the density alone decides the side, the value is the branch that does.
struct LevelSet {
  std::vector<std::array<float, kTileNodes>> tiles;
  std::vector<BitRows> inside;  ///< By tile: the nodes at which F < 0.
  float void_value = 0;         ///< F where no particle reaches, hence in tiles that do not exist.

  // Scratch.
  std::vector<BitRows> open;         ///< By tile: the nodes that the density does not decide.
  std::vector<std::uint8_t> passes;  ///< By tile: how many are done (SampleField).
  DensityHalo halo;

  /// F at the node (i, j) of `tile`, 0 <= i, j <= 32: the last row and column are the neighbours'.
  float At(const TileDirectory& directory, std::uint32_t tile, int i, int j) const {
    if (i < kTileSize && j < kTileSize) return tiles[tile][j * kTileSize + i];
    const TilePlace place = Normalise(directory, tile, i, j);
    return place.tile == kNoTile ? void_value : tiles[place.tile][place.j * kTileSize + place.i];
  }
};

/// Samples F at the nodes of every tile of `bins`: the density everywhere, the moments only where
/// the density leaves the side of a node open, and at the other end of an edge that is crossed.
/// Accuracy: 1e-5 relative to f = 1 for f, for nodes and particles as rounded by the bins.
/// Deterministic: sums run over the lists of a node's tile and of its neighbours in one order,
/// whatever the threads and the instruction set. Parallel over tiles.
/// Cost: linear in the particles, times the square of the kernel radius in cells.
void SampleField(const ParticleBins& bins, const Scale& scale, LevelSet& level_set);

}  // namespace partiemc
