// Finds the tiles that the particles of a tile require around it.
#pragma once

#include <bit>
#include <cstdint>
#include <span>

#include "bins/bins.h"
#include "bins/lattice.h"

namespace partiemc {

/// Sets of tiles around a home tile: bit 5 (dy + 2) + dx + 2 is the tile at (dx, dy).
class TileHalo {
 public:
  /// `reach`: a particle reaches the tiles within this distance, in cells; less than two tiles.
  explicit TileHalo(float reach) : reach_(reach) {}

  /// The tiles that the particles of a tile reach. Cost: linear.
  std::uint32_t Of(std::span<const BinnedParticle> particles) const;

  /// Whether the particles of a tile reach at most its eight neighbours.
  bool AreNeighbours() const { return reach_ <= kTileSize; }

  /// Calls visit(tile) for each tile of a set.
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
