// Sets of cells in a tile and around it, as bits: which particles a step has to look at.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>

#include "bins.h"
#include "lattice.h"

namespace partiemc {

/// Cells from kMaskMargin before a tile to kMaskMargin beyond it: cell (i, j) is bit
/// i + kMaskMargin of row j + kMaskMargin.
inline constexpr int kMaskMargin = kTileSize / 2;
using CellMask = std::array<std::uint64_t, kTileSize + 2 * kMaskMargin>;

/// Whether the particle of an entry lies in a cell of the mask.
/// Requires: it is less than kMaskMargin cells away from the tile.
inline bool IsInMask(const CellMask& mask, const BinEntry& entry) {
  const int column = static_cast<int>(entry.x + kMaskMargin);
  const int row = static_cast<int>(entry.y + kMaskMargin);
  return (mask[row] >> column & 1) != 0;
}

/// The same for a mask that holds cells of the tile alone, and for a particle of its list wherever
/// it is: one beyond the mask wraps round into the margin.
inline bool IsInTileMask(const CellMask& mask, const BinEntry& entry) {
  static_assert(std::tuple_size_v<CellMask> == 64 && kMaskMargin * 2 == kTileSize);
  const int column = static_cast<int>(entry.x + kMaskMargin) & 63;
  const int row = static_cast<int>(entry.y + kMaskMargin) & 63;
  return (mask[row] >> column & 1) != 0;
}

/// The cells (i + di, j + dj), -before <= di, dj <= after, of every bit (i, j) of `rows`.
/// Requires: 0 <= before, after <= kMaskMargin.
inline CellMask Widened(const BitRows& rows, int before, int after) {
  CellMask mask{};
  for (int j = 0; j < kTileSize; ++j) {
    if (rows[j] == 0) continue;
    std::uint64_t cells = 0;
    for (int d = -before; d <= after; ++d) cells |= std::uint64_t{rows[j]} << (kMaskMargin + d);
    const int centre = j + kMaskMargin;
    const int end = std::min(centre + after, static_cast<int>(mask.size()) - 1);
    for (int row = centre - before; row <= end; ++row) mask[row] |= cells;
  }
  return mask;
}

/// Where bits of a tile and of its neighbours are at most `distance` cells away, along each axis:
/// the cells of the tile. rows_of(index) are the rows of an existing tile.
/// Requires: 0 <= distance <= kMaskMargin.
template <typename RowsOf>
BitRows CellsNear(const TileDirectory& directory, std::uint32_t tile, int distance,
                  RowsOf rows_of) {
  const Neighbourhood& near = directory.neighbours(tile);
  BitRows result{};
  for (int row = -distance; row < kTileSize + distance; ++row) {
    const int dy = row >> kTileShift;
    std::uint64_t cells = 0;
    for (int dx = -1; dx <= 1; ++dx) {
      const std::uint32_t owner = near[(dy + 1) * 3 + dx + 1];
      if (owner == kNoTile) continue;
      const std::uint64_t bits = rows_of(owner)[row & (kTileSize - 1)];
      cells |= dx < 0 ? bits >> (kTileSize - kMaskMargin) : bits << (kMaskMargin + dx * kTileSize);
    }
    if (cells == 0) continue;
    std::uint64_t widened = 0;
    for (int d = 0; d <= distance; ++d) widened |= cells << d | cells >> d;
    const auto bits = static_cast<std::uint32_t>(widened >> kMaskMargin);
    for (int j = std::max(row - distance, 0); j <= std::min(row + distance, kTileSize - 1); ++j) {
      result[j] |= bits;
    }
  }
  return result;
}

}  // namespace partiemc
