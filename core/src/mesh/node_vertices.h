// Numbers the lattice nodes that are vertices of a mesh.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "base/bits.h"
#include "base/point.h"
#include "bins/lattice.h"

namespace partiemc {

/// A set of nodes, stored as bits by tile. After Number, their numbers are consecutive.
class NodeVertices {
 public:
  /// Removes all nodes. Cost: linear in tiles.
  void Clear(std::size_t tile_count) { tiles_.assign(tile_count, {}); }

  /// Adds a node. Adding it again has no effect.
  void Add(const TilePlace& node) { tiles_[node.tile].nodes[node.j] |= std::uint32_t{1} << node.i; }

  /// Numbers the nodes by tile, row and column, starting with `first`.
  void Number(std::uint32_t first);

  /// Appends the positions of the nodes in the order of their numbers, interleaved, in world units.
  /// Requires: Number was called after the last Add.
  void AppendPoints(const TileDirectory& directory, double cell_size,
                    std::vector<double>& points) const;

  bool Contains(const TilePlace& node) const {
    return (tiles_[node.tile].nodes[node.j] >> node.i & 1) != 0;
  }

  /// The number of a node. Requires: the node was added before Number.
  std::uint32_t At(const TilePlace& node) const {
    const Tile& tile = tiles_[node.tile];
    const std::uint32_t before = (std::uint32_t{1} << node.i) - 1;
    return tile.first + tile.before_row[node.j] +
           static_cast<std::uint32_t>(CountBits(tile.nodes[node.j] & before));
  }

 private:
  struct Tile {
    BitRows nodes{};
    std::array<std::uint16_t, kTileSize> before_row;  // Count of the tile's nodes in lower rows.
    std::uint32_t first;                              // Vertex number of the tile's first node.
  };

  std::vector<Tile> tiles_;
  std::size_t count_ = 0;
};

/// Position of a node in world units.
inline Point NodePoint(const TileDirectory& directory, const TilePlace& node, double cell_size) {
  const auto world = [cell_size](std::int32_t tile, int offset) {
    return static_cast<double>((std::int64_t{tile} << kTileShift) + offset) * cell_size;
  };
  const TileCoordinate& tile = directory[node.tile];
  return {world(tile.x, node.i), world(tile.y, node.j)};
}

inline void NodeVertices::Number(std::uint32_t first) {
  std::uint32_t next = first;
  for (Tile& tile : tiles_) {
    tile.first = next;
    std::array<std::uint16_t, kTileSize> counts;
    for (int j = 0; j < kTileSize; ++j) {
      counts[j] = static_cast<std::uint16_t>(CountBits(tile.nodes[j]));
    }
    std::exclusive_scan(counts.begin(), counts.end(), tile.before_row.begin(), std::uint16_t{0});
    next += std::uint32_t{tile.before_row.back()} + counts.back();
  }
  count_ = next - first;
}

inline void NodeVertices::AppendPoints(const TileDirectory& directory, double cell_size,
                                       std::vector<double>& points) const {
  const std::size_t size_before = points.size();
  points.resize(size_before + 2 * count_);
  double* next = points.data() + size_before;
  for (std::uint32_t k = 0; k < tiles_.size(); ++k) {
    for (int j = 0; j < kTileSize; ++j) {
      const double y = NodePoint(directory, {k, 0, j}, cell_size).y;
      for (std::uint32_t rest = tiles_[k].nodes[j]; rest != 0; rest &= rest - 1) {
        *next++ = NodePoint(directory, {k, std::countr_zero(rest), j}, cell_size).x;
        *next++ = y;
      }
    }
  }
}

}  // namespace partiemc
