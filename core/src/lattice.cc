#include "lattice.h"

#include <algorithm>

namespace partiemc {

void TileDirectory::Clear() {
  tiles_.clear();
  neighbours_.clear();
  std::fill(slots_.begin(), slots_.end(), kNoTile);
}

void TileDirectory::Grow() {
  slots_.assign(std::max<std::size_t>(64, 2 * slots_.size()), kNoTile);
  for (std::uint32_t tile = 0; tile < tiles_.size(); ++tile) slots_[Slot(tiles_[tile])] = tile;
}

void TileDirectory::Sort() {
  std::sort(tiles_.begin(), tiles_.end());
  std::fill(slots_.begin(), slots_.end(), kNoTile);
  for (std::uint32_t tile = 0; tile < tiles_.size(); ++tile) slots_[Slot(tiles_[tile])] = tile;
}

void TileDirectory::Seal() {
  Sort();
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
