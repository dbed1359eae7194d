// Points relative to the nodes of a tile.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/point.h"
#include "bins/lattice.h"

namespace partiemc {

/// The first node of a tile, in cells from the origin of the world.
inline Point OriginOf(const TileDirectory& directory, std::uint32_t tile) {
  return {static_cast<double>(std::int64_t{directory[tile].x} << kTileShift),
          static_cast<double>(std::int64_t{directory[tile].y} << kTileShift)};
}

/// A point among the four nodes around it.
struct Surrounded {
  int i, j;     ///< The node left of the point and below it, relative to the tile.
  double u, v;  ///< The point relative to this node.

  /// Takes a point of a tile, or of a tile beside it.
  Surrounded(const TileDirectory& directory, std::uint32_t tile, const Point& point) {
    const Point origin = OriginOf(directory, tile);
    const double x = std::clamp<double>(point.x - origin.x, -kTileSize, 2 * kTileSize - 1.001);
    const double y = std::clamp<double>(point.y - origin.y, -kTileSize, 2 * kTileSize - 1.001);
    i = static_cast<int>(std::floor(x));
    j = static_cast<int>(std::floor(y));
    u = x - i;
    v = y - j;
  }
};

}  // namespace partiemc
