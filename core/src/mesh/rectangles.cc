#include "mesh/rectangles.h"

#include <bit>

#include "base/bits.h"

namespace partiemc {
namespace {

// Moves free cells of row j into `span`: from (tile, i) to the right until the first cell that is
// not free, across tiles. Returns their number.
int TakeRow(const TileDirectory& directory, MergeScratch& scratch, std::uint32_t tile, int i,
            int j) {
  int width = 0;
  scratch.span.clear();
  while (true) {
    const std::uint32_t row = scratch.free[tile][j] >> i;
    const int length = std::countr_one(row);
    if (length == 0) return width;
    const std::uint32_t mask = (0xffffffffu >> (kTileSize - length)) << i;
    scratch.free[tile][j] &= ~mask;
    scratch.span.emplace_back(tile, mask);
    width += length;
    if (i + length < kTileSize) return width;
    tile = directory.neighbours(tile)[5];
    i = 0;
    if (tile == kNoTile) return width;
  }
}

// Removes the rows above `span` from the free cells, while all cells of a row are free. `row` is
// the first of these rows, counted from the first row of the span's tiles. Returns the first row
// that is not free, and moves `span` to the tiles of that row. Works tile by tile, because the rows
// of a tile are contiguous.
int TakeRowsAbove(const TileDirectory& directory, MergeScratch& scratch, int row) {
  while (true) {
    const int first = row % kTileSize;
    if (first == 0) {
      for (auto& [tile, mask] : scratch.span) {
        tile = directory.neighbours(tile)[7];
        if (tile == kNoTile) return row;
      }
    }
    int last = kTileSize;
    for (const auto& [tile, mask] : scratch.span) {
      const BitRows& free = scratch.free[tile];
      int j = first;
      while (j < last && (free[j] & mask) == mask) ++j;
      last = j;
      if (last == first) return row;
    }
    for (const auto& [tile, mask] : scratch.span) {
      BitRows& free = scratch.free[tile];
      for (int j = first; j < last; ++j) free[j] &= ~mask;
    }
    row += last - first;
    if (last < kTileSize) return row;
  }
}

}  // namespace

std::array<TilePlace, 4> CornersOf(const TileDirectory& directory, const CellRectangle& rectangle) {
  const auto moved = [&](TilePlace place, int right, int up) {
    for (place.i += right; place.i >= kTileSize; place.i -= kTileSize) {
      place.tile = directory.neighbours(place.tile)[5];
    }
    for (place.j += up; place.j >= kTileSize; place.j -= kTileSize) {
      place.tile = directory.neighbours(place.tile)[7];
    }
    return place;
  };
  const TilePlace& corner = rectangle.corner;
  const TilePlace right = moved(corner, rectangle.width, 0);
  return {corner, right, moved(right, 0, rectangle.height), moved(corner, 0, rectangle.height)};
}

std::uint64_t CountCells(std::span<const BitRows> cells) {
  std::uint64_t count = 0;
  for (const BitRows& rows : cells) {
    for (const std::uint32_t row : rows) count += CountBits(row);
  }
  return count;
}

void MergeCells(const TileDirectory& directory, std::span<const BitRows> interior,
                MergeScratch& scratch, std::vector<CellRectangle>& rectangles) {
  scratch.free.assign(interior.begin(), interior.end());
  // Scans each row of cells across all tiles of a tile row, so that the rectangles do not depend on
  // the borders of tiles. Tiles are sorted by row.
  for (std::uint32_t first = 0; first < interior.size();) {
    std::uint32_t last = first;
    while (last < interior.size() && directory[last].y == directory[first].y) ++last;
    for (int j = 0; j < kTileSize; ++j) {
      for (std::uint32_t tile = first; tile < last; ++tile) {
        while (scratch.free[tile][j] != 0) {
          const int i = std::countr_zero(scratch.free[tile][j]);
          const int width = TakeRow(directory, scratch, tile, i, j);
          const int height = TakeRowsAbove(directory, scratch, j + 1) - j;
          rectangles.push_back({{tile, i, j}, width, height});
        }
      }
    }
    first = last;
  }
}

}  // namespace partiemc
