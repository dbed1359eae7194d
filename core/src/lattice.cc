#include "lattice.h"

#include <algorithm>

namespace partiemc {

void TileDirectory::Clear() {
  tiles_.clear();
  neighbours_.clear();
  std::fill(slots_.begin(), slots_.end(), kNoTile);
}

std::size_t TileDirectory::Slot(TileCoordinate tile) const {
  // Fibonacci hashing of the pair; neighbouring tiles land far apart.
  const auto x = static_cast<std::uint64_t>(static_cast<std::uint32_t>(tile.x));
  const auto y = static_cast<std::uint64_t>(static_cast<std::uint32_t>(tile.y));
  std::uint64_t key = (y << 32 | x) * 0x9e3779b97f4a7c15u;
  key ^= key >> 29;
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = key & mask;
  while (slots_[slot] != kNoTile && tiles_[slots_[slot]] != tile) slot = (slot + 1) & mask;
  return slot;
}

void TileDirectory::Grow() {
  slots_.assign(std::max<std::size_t>(64, 2 * slots_.size()), kNoTile);
  for (std::uint32_t tile = 0; tile < tiles_.size(); ++tile) slots_[Slot(tiles_[tile])] = tile;
}

void TileDirectory::Insert(TileCoordinate tile) {
  if (2 * (tiles_.size() + 1) > slots_.size()) Grow();
  const std::size_t slot = Slot(tile);
  if (slots_[slot] != kNoTile) return;
  slots_[slot] = static_cast<std::uint32_t>(tiles_.size());
  tiles_.push_back(tile);
}

std::uint32_t TileDirectory::Find(TileCoordinate tile) const {
  return slots_.empty() ? kNoTile : slots_[Slot(tile)];
}

void TileDirectory::Seal() {
  std::sort(tiles_.begin(), tiles_.end());
  std::fill(slots_.begin(), slots_.end(), kNoTile);
  for (std::uint32_t tile = 0; tile < tiles_.size(); ++tile) slots_[Slot(tiles_[tile])] = tile;
  neighbours_.resize(tiles_.size());
  for (std::size_t tile = 0; tile < tiles_.size(); ++tile) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        neighbours_[tile][(dy + 1) * 3 + dx + 1] = Find({tiles_[tile].y + dy, tiles_[tile].x + dx});
      }
    }
  }
}

}  // namespace partiemc
