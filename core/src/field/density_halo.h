// Adds the density of a tile's particles at the nodes of neighbouring tiles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/prefetch.h"
#include "bins/bins.h"
#include "field/tile_kernels.h"

namespace partiemc {

/// The margins of the NodeSums of all tiles with particles, kept until the neighbours add them.
///
///   uuuuuuuuuuuuuu
///   llll      rrrr     u: rows within reach of the kernel; l and r: kSumMargin columns
///   llll tile rrrr
///   llll      rrrr
///   uuuuuuuuuuuuuu
///
/// AddTo skips parts that no kernel reaches.
class DensityHalo {
 public:
  /// Allocates the margins. Requires: radius <= kSumMargin.
  void Prepare(const ParticleBins& bins, float radius);

  /// Prefetches the memory for the margins of a tile. Requires: the tile has particles.
  void Prefetch(std::uint32_t tile) const {
    PrefetchLines(std::span(values_).subspan(std::size_t{rim_[tile]} * Size(),
                                             static_cast<std::size_t>(Size())));
  }

  /// Stores the margins of a tile's sums. Requires: the tile has particles.
  void Keep(std::uint32_t tile, const NodeSums& sums);

  /// Adds the margins of the neighbours to the 32 x 32 values of a tile, in the order of
  /// Neighbourhood.
  void AddTo(const TileDirectory& directory, std::uint32_t tile, float* values) const;

 private:
  // Offsets in a margin: lower rows, upper rows, left side, right side.
  int UpperRows() const { return rows_ * kSumColumns; }
  int LeftSide() const { return 2 * rows_ * kSumColumns; }
  int RightSide() const { return LeftSide() + kTileSize * kSumMargin; }
  int Size() const { return RightSide() + kTileSize * kSumMargin; }

  // Bits of the parts of a margin.
  enum Part : std::uint8_t { kLower = 1, kUpper = 2, kLeft = 4, kRight = 8 };

  int rows_ = 0;
  std::vector<std::uint32_t> rim_;   // By tile: index of its margin, or kNoTile.
  std::vector<std::uint8_t> parts_;  // By margin: the parts that are not 0.
  std::vector<float> values_;
};

}  // namespace partiemc
