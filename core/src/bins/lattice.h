// The lattice: fixed in world coordinates, sparse, in tiles of 32 x 32 nodes.
//
// Node (i, j) lies at (i, j) * cell_size in world coordinates. Tile (x, y) owns the nodes [32 x, 32
// x + 32) x [32 y, 32 y + 32) and the cells whose lower left node it owns. A row of a tile is a
// 32-bit word: bit i is node or cell i of that row.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/bits.h"

namespace partiemc {

inline constexpr int kTileShift = 5;
inline constexpr int kTileSize = 1 << kTileShift;
inline constexpr int kTileNodes = kTileSize * kTileSize;

using BitRows = std::array<std::uint32_t, kTileSize>;

struct TileCoordinate {
  std::int32_t y = 0, x = 0;  // In this order: tiles are sorted by row, then column.
  friend auto operator<=>(const TileCoordinate&, const TileCoordinate&) = default;
};

/// Index of a tile that does not exist. The nodes of such a tile are outside.
inline constexpr std::uint32_t kNoTile = std::numeric_limits<std::uint32_t>::max();

/// Neighbours of a tile at index (dy + 1) * 3 + (dx + 1), with the tile itself in the middle.
using Neighbourhood = std::array<std::uint32_t, 9>;

/// The tiles of a frame, sorted, with their neighbours.
class TileDirectory {
 public:
  /// Removes all tiles; keeps the memory.
  void Clear();

  /// Adds a tile if it does not exist. Returns its index, in insertion order.
  std::uint32_t Insert(TileCoordinate tile);

  /// Sorts the tiles. The index of a tile is then its position in the sorted order. Insert appends
  /// further tiles unsorted.
  void Sort();

  /// Sorts the tiles and sets `neighbours`. A later Insert or Sort makes `neighbours` invalid.
  void Seal();

  std::size_t size() const { return tiles_.size(); }
  std::span<const TileCoordinate> tiles() const { return tiles_; }
  const TileCoordinate& operator[](std::size_t tile) const { return tiles_[tile]; }
  const Neighbourhood& neighbours(std::size_t tile) const { return neighbours_[tile]; }

  /// Index of a tile, or kNoTile.
  std::uint32_t Find(TileCoordinate tile) const;

  /// The hash of a tile in the table of tiles.
  static std::uint64_t HashOf(TileCoordinate tile) {
    return TableHash(std::uint64_t{static_cast<std::uint32_t>(tile.y)} << 32 |
                     static_cast<std::uint32_t>(tile.x));
  }

 private:
  std::size_t Slot(TileCoordinate tile) const;
  void Grow();

  std::vector<TileCoordinate> tiles_;
  std::vector<Neighbourhood> neighbours_;
  std::vector<std::uint32_t> slots_;  // Open addressing, linear probing; kNoTile marks a free slot.
};

inline std::size_t TileDirectory::Slot(TileCoordinate tile) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = HashOf(tile) & mask;
  while (slots_[slot] != kNoTile && tiles_[slots_[slot]] != tile) slot = (slot + 1) & mask;
  return slot;
}

inline std::uint32_t TileDirectory::Insert(TileCoordinate tile) {
  if (2 * (tiles_.size() + 1) > slots_.size()) Grow();
  std::uint32_t& index = slots_[Slot(tile)];
  if (index == kNoTile) {
    index = static_cast<std::uint32_t>(tiles_.size());
    tiles_.push_back(tile);
  }
  return index;
}

inline std::uint32_t TileDirectory::Find(TileCoordinate tile) const {
  return slots_.empty() ? kNoTile : slots_[Slot(tile)];
}

/// A node or cell: its tile, and its column and row in the tile, 0 <= i, j < 32.
struct TilePlace {
  std::uint32_t tile;
  int i, j;
};

/// Finds the tile that owns the node or cell (i, j), given relative to `tile`, -32 <= i, j < 64,
/// and its place there. The owner is kNoTile if that tile does not exist.
inline TilePlace Normalise(const TileDirectory& directory, std::uint32_t tile, int i, int j) {
  const int dx = i >> kTileShift;
  const int dy = j >> kTileShift;
  const std::uint32_t owner = directory.neighbours(tile)[(dy + 1) * 3 + dx + 1];
  return {owner, i & (kTileSize - 1), j & (kTileSize - 1)};
}

}  // namespace partiemc
