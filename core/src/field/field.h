// Stage 2 of 9: computes the level set at the nodes of every tile (paper, Eq. 1-5).
#pragma once

#include <array>
#include <vector>

#include "bins/bins.h"
#include "bins/lattice.h"
#include "field/density_halo.h"
#include "frame/scale.h"

namespace partiemc {

/// The level set F in cells, negative inside (level_set_formula.h); with own sizes, F times the
/// local size. Node (i, j) of a tile has index j * 32 + i.
///
/// Values are exact at both ends of every lattice edge that the outline crosses. At other nodes
/// only the sign is right: the value may be the density term that decides the side.
struct LevelSet {
  std::vector<std::array<float, kTileNodes>> tiles;
  std::vector<BitRows> inside;  ///< By tile: the nodes with F < 0.
  float void_value = 0;         ///< F beyond all kernels, also in tiles that do not exist.

  // Scratch.
  std::vector<BitRows> open;         ///< By tile: the nodes whose side the density does not decide.
  std::vector<std::uint8_t> passes;  ///< By tile: its last finished pass.
  DensityHalo halo;

  /// F at node (i, j) relative to `tile`, 0 <= i, j <= 32. Row and column 32 belong to neighbours.
  float At(const TileDirectory& directory, std::uint32_t tile, int i, int j) const {
    if (i < kTileSize && j < kTileSize) return tiles[tile][j * kTileSize + i];
    const TilePlace place = Normalise(directory, tile, i, j);
    return place.tile == kNoTile ? void_value : tiles[place.tile][place.j * kTileSize + place.i];
  }
};

/// Computes F at the nodes of every tile of `bins`. The density is summed at all nodes. The moments
/// are summed only at the ends of crossed edges and at nodes whose side the density does not
/// decide. Accuracy of f, for the rounded positions of the bins: 1e-5, relative to f = 1 inside a
/// body.
/// Deterministic for any number of threads and any instruction set: the particles of a node's tile
/// and of its neighbours are summed in one order. Parallel over tiles. Cost: linear in the
/// particles, times the square of the kernel radius in cells.
void SampleField(const ParticleBins& bins, const Scale& scale, LevelSet& level_set);

/// Sets `sizes` at the requested nodes of a tile to the local size, in spacings; 0 where no kernel
/// reaches. Requires: own sizes. Cost: linear in the particles near the requested nodes.
void FindLocalSizes(const ParticleBins& bins, const Scale& scale, std::uint32_t tile,
                    const BitRows& asked, std::array<float, kTileNodes>& sizes);

}  // namespace partiemc
