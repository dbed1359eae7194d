// Which vertices of a mesh are nodes of the lattice.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bits.h"
#include "lattice.h"

namespace partiemc {

/// Nodes that a mesh names, as bits by tile: a node's number follows from the bits before it.
/// Keeps its memory warm from frame to frame.
class NodeVertices {
 public:
  /// Forgets all nodes. Cost: linear in tiles.
  void Clear(std::size_t tile_count) { tiles_.assign(tile_count, {}); }

  /// Names a node, once or several times.
  void Add(const TilePlace& node) { tiles_[node.tile].named[node.j] |= std::uint32_t{1} << node.i; }

  /// Numbers the nodes by tile, row, column, and appends them to `points`, interleaved and in world
  /// units. The first gets the number of points that are there already.
  void Number(const TileDirectory& directory, double cell_size, std::vector<double>& points);

  /// The point of a node. Requires: it was named before Number.
  std::uint32_t At(const TilePlace& node) const {
    const Tile& tile = tiles_[node.tile];
    const std::uint32_t before = (std::uint32_t{1} << node.i) - 1;
    return tile.first + tile.before_row[node.j] +
           static_cast<std::uint32_t>(CountBits(tile.named[node.j] & before));
  }

 private:
  struct Tile {
    BitRows named{};
    std::array<std::uint16_t, kTileSize> before_row;  // Nodes of the tile in the rows below.
    std::uint32_t first;                              // Points before those of the tile.
  };

  std::vector<Tile> tiles_;
};

inline void NodeVertices::Number(const TileDirectory& directory, double cell_size,
                                 std::vector<double>& points) {
  const auto world = [cell_size](std::int32_t tile, int offset) {
    return static_cast<double>((std::int64_t{tile} << kTileShift) + offset) * cell_size;
  };
  for (std::size_t k = 0; k < tiles_.size(); ++k) {
    Tile& tile = tiles_[k];
    tile.first = static_cast<std::uint32_t>(points.size() / 2);
    std::uint32_t count = 0;
    for (int j = 0; j < kTileSize; ++j) {
      tile.before_row[j] = static_cast<std::uint16_t>(count);
      const double y = world(directory[k].y, j);
      for (std::uint32_t rest = tile.named[j]; rest != 0; rest &= rest - 1) {
        points.push_back(world(directory[k].x, std::countr_zero(rest)));
        points.push_back(y);
        ++count;
      }
    }
  }
}

}  // namespace partiemc
