// Sets of cells in and around a tile, as bits that select particles (masked_particles.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bins/lattice.h"

namespace partiemc {

/// A CellMask is a set of cells of a tile and of a margin of kMaskMargin cells around it: cell (i,
/// j) is bit i + kMaskMargin of row j + kMaskMargin.
inline constexpr int kMaskMargin = kTileSize / 2;
using CellMask = std::array<std::uint64_t, kTileSize + 2 * kMaskMargin>;

/// Index of a tile in its own Neighbourhood.
inline constexpr int kOwnPlace = 4;

inline bool IsEmpty(const BitRows& rows) {
  std::uint32_t any = 0;
  for (const std::uint32_t row : rows) any |= row;
  return any == 0;
}

/// The cells of a mask that lie in the tile at index `place` of the Neighbourhood.
inline BitRows CellsOfNeighbour(const CellMask& mask, int place) {
  const int dx = place % 3 - 1;
  const int dy = place / 3 - 1;
  const int first = dy < 0 ? kTileSize - kMaskMargin : 0;
  const int end = dy > 0 ? kMaskMargin : kTileSize;
  // The margin left of the tile holds the last columns of the left neighbour.
  const int up = dx < 0 ? kTileSize - kMaskMargin : 0;
  const int down = dx < 0 ? 0 : dx > 0 ? kTileSize + kMaskMargin : kMaskMargin;
  BitRows cells{};
  for (int j = first; j < end; ++j) {
    const std::uint64_t bits = mask[j + dy * kTileSize + kMaskMargin];
    cells[j] = static_cast<std::uint32_t>(bits << up >> down);
  }
  return cells;
}

/// A mask with the cells of one tile.
inline CellMask MaskOf(const BitRows& rows) {
  CellMask mask{};
  for (int j = 0; j < kTileSize; ++j) mask[j + kMaskMargin] = std::uint64_t{rows[j]} << kMaskMargin;
  return mask;
}

/// A mask with the cells of a tile and of its neighbours, up to `margin` rows below and above the
/// tile and kMaskMargin columns beside it. rows_of(index) returns the rows of an existing tile.
/// Requires: 0 <= margin <= kMaskMargin.
template <typename RowsOf>
CellMask CellsAround(const TileDirectory& directory, std::uint32_t tile, int margin,
                     RowsOf rows_of) {
  const Neighbourhood& near = directory.neighbours(tile);
  CellMask mask{};
  for (int place = 0; place < static_cast<int>(near.size()); ++place) {
    if (near[place] == kNoTile) continue;
    const BitRows& rows = rows_of(near[place]);
    const int dx = place % 3 - 1;
    const int dy = place / 3 - 1;
    const int first = dy < 0 ? kTileSize - margin : 0;
    const int end = dy > 0 ? margin : kTileSize;
    const int up = dx < 0 ? 0 : kMaskMargin + dx * kTileSize;
    const int down = dx < 0 ? kTileSize - kMaskMargin : 0;
    for (int j = first; j < end; ++j) {
      mask[j + dy * kTileSize + kMaskMargin] |= std::uint64_t{rows[j]} >> down << up;
    }
  }
  return mask;
}

/// Adds the cells (i + di, j + dj), -before <= di, dj <= after, of every cell (i, j) of the mask.
/// Cells beyond the margin are unknown and add nothing. Requires: 0 <= before, after <=
/// kMaskMargin.
inline void Widen(CellMask& mask, int before, int after) {
  // Rows change in an order in which each row is read before it is changed.
  for (int step = 0; step < before; ++step) {
    for (std::uint64_t& row : mask) row |= row >> 1;
    for (std::size_t row = 0; row + 1 < mask.size(); ++row) mask[row] |= mask[row + 1];
  }
  for (int step = 0; step < after; ++step) {
    for (std::uint64_t& row : mask) row |= row << 1;
    for (std::size_t row = mask.size() - 1; row > 0; --row) mask[row] |= mask[row - 1];
  }
}

}  // namespace partiemc
