// Which tiles must exist because of the particles in one tile.
#pragma once

#include <bit>
#include <cstdint>
#include <span>

#include "bins/bins.h"
#include "bins/lattice.h"

namespace partiemc {

/// Sets of tiles around one: bit 5 (dy + 2) + dx + 2 stands for the one at (dx, dy) from it.
class TileHalo {
 public:
  /// `reach`: how far from a particle tiles exist, in cells, less than two tiles.
  explicit TileHalo(float reach) : reach_(reach) {}

  /// The tiles that particles of a tile reach. Cost: linear. The same for any instruction set.
  std::uint32_t Of(std::span<const BinnedParticle> particles) const;

  /// Whether they are the eight neighbours at most.
  bool AreNeighbours() const { return reach_ <= kTileSize; }

  /// Calls visit(tile) for each.
  template <typename Visit>
  static void ForEach(TileCoordinate home, std::uint32_t reached, Visit visit) {
    for (; reached != 0; reached &= reached - 1) {
      const int place = std::countr_zero(reached);
      visit(TileCoordinate{home.y + place / 5 - 2, home.x + place % 5 - 2});
    }
  }

 private:
  float reach_;
};

}  // namespace partiemc
