#include "bins/lattice.h"

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
  Neighbourhood alone;
  alone.fill(kNoTile);
  neighbours_.assign(tiles_.size(), alone);
  // Tiles are sorted, so the search for the next row only moves forward.
  std::uint32_t above = 0;
  for (std::uint32_t tile = 0; tile < tiles_.size(); ++tile) {
    const auto [y, x] = tiles_[tile];
    const auto link = [&](std::uint32_t to, int dy, int dx) {
      const int place = (dy + 1) * 3 + dx + 1;
      neighbours_[tile][place] = to;
      neighbours_[to][8 - place] = tile;
    };
    link(tile, 0, 0);
    if (tile + 1 < tiles_.size() && tiles_[tile + 1] == TileCoordinate{y, x + 1}) {
      link(tile + 1, 0, 1);
    }
    while (above < tiles_.size() && tiles_[above] < TileCoordinate{y + 1, x - 1}) ++above;
    for (std::uint32_t k = above; k < tiles_.size() && tiles_[k] <= TileCoordinate{y + 1, x + 1};
         ++k) {
      link(k, 1, tiles_[k].x - x);
    }
  }
}

}  // namespace partiemc
