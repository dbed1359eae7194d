// What the kernels of a tile's particles add to nodes of the tiles around it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/prefetch.h"
#include "bins/bins.h"
#include "field/tile_kernels.h"

namespace partiemc {

/// The margins of the sums of all tiles that hold particles, kept until their neighbours take them.
///
///   uuuuuuuuuuuuuu
///   llll      rrrr     u: as many rows as the kernel reaches, l and r: kSumMargin columns
///   llll tile rrrr
///   llll      rrrr
///   uuuuuuuuuuuuuu
///
/// A part that no kernel of the tile reaches is left out.
class DensityHalo {
 public:
  /// Makes room for kernels of a radius of at most kSumMargin.
  void Prepare(const ParticleBins& bins, float radius);

  /// Asks the memory for where the margins of a tile will be kept. Requires: it holds particles.
  void Prefetch(std::uint32_t tile) const {
    PrefetchLines(std::span(values_).subspan(std::size_t{rim_[tile]} * Size(),
                                             static_cast<std::size_t>(Size())));
  }

  /// Keeps the margins of a tile's sums. Requires: the tile holds particles.
  void Keep(std::uint32_t tile, const NodeSums& sums);

  /// Adds what the neighbours of a tile have kept for its 32 x 32 values, neighbour after neighbour
  /// in the order of Neighbourhood.
  void AddTo(const TileDirectory& directory, std::uint32_t tile, float* values) const;

 private:
  // Places in a rim. The lower rows come first, then the upper ones, the left side and the right.
  int UpperRows() const { return rows_ * kSumColumns; }
  int LeftSide() const { return 2 * rows_ * kSumColumns; }
  int RightSide() const { return LeftSide() + kTileSize * kSumMargin; }
  int Size() const { return RightSide() + kTileSize * kSumMargin; }

  // Bits of the parts of a rim.
  enum Part : std::uint8_t { kLower = 1, kUpper = 2, kLeft = 4, kRight = 8 };

  int rows_ = 0;
  std::vector<std::uint32_t> rim_;   // By tile: which of the rims below, or kNoTile.
  std::vector<std::uint8_t> parts_;  // By rim: those that are kept, as some of it is not 0.
  std::vector<float> values_;
};

}  // namespace partiemc
