#include "mesh/interior.h"

#include <bit>
#include <utility>

#include "bins/cell_mask.h"

namespace partiemc {
namespace {

enum Heading { kEast = 0, kNorth = 1, kWest = 2, kSouth = 3 };

constexpr int kStepX[4] = {1, 0, -1, 0};
constexpr int kStepY[4] = {0, 1, 0, -1};
// Cells ahead of a node on the left and on the right, relative to the node, by heading.
constexpr int kLeftX[4] = {0, -1, -1, 0};
constexpr int kLeftY[4] = {0, 0, -1, -1};
constexpr int kRightX[4] = {0, 0, -1, -1};
constexpr int kRightY[4] = {-1, 0, 0, -1};

bool IsInterior(const TileDirectory& directory, std::span<const BitRows> interior,
                const TilePlace& node, int dx, int dy) {
  const TilePlace cell = Normalise(directory, node.tile, node.i + dx, node.j + dy);
  return cell.tile != kNoTile && (interior[cell.tile][cell.j] >> cell.i & 1) != 0;
}

// The cells of a tile that are interior above a cell that is not.
BitRows BottomEdges(const TileDirectory& directory, std::span<const BitRows> interior,
                    std::uint32_t tile) {
  const BitRows& rows = interior[tile];
  const std::uint32_t below = directory.neighbours(tile)[1];
  BitRows edges;
  edges[0] = rows[0] & ~(below == kNoTile ? 0 : interior[below][kTileSize - 1]);
  for (int j = 1; j < kTileSize; ++j) edges[j] = rows[j] & ~rows[j - 1];
  return edges;
}

// Walks one loop that starts eastward along the bottom edge of the cell at `start`.
void TraceLoop(const TileDirectory& directory, std::span<const BitRows> interior,
               const TilePlace& start, Staircases& staircases) {
  TilePlace node = start;
  int heading = kEast;
  do {
    staircases.visited[node.tile][node.j] |= std::uint32_t{heading == kEast} << node.i;
    node = Normalise(directory, node.tile, node.i + kStepX[heading], node.j + kStepY[heading]);
    const bool left = IsInterior(directory, interior, node, kLeftX[heading], kLeftY[heading]);
    const bool right = IsInterior(directory, interior, node, kRightX[heading], kRightY[heading]);
    if (left && !right) continue;  // Straight on: `continue` still tests the loop's end.
    if (right && !left) ++staircases.pinches;
    heading = (heading + (left ? 3 : 1)) & 3;
    staircases.corners.push_back(node);
  } while (node.tile != start.tile || node.i != start.i || node.j != start.j || heading != kEast);
  staircases.offsets.push_back(static_cast<std::uint32_t>(staircases.corners.size()));
}

// Takes the free cells of row j from (tile, i) eastward into `span`, across tiles; returns their
// number.
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

// Takes the rows above the span's as long as all of their cells are free, `row` being the first of
// them in rows from the start of the span's tiles. Returns the row that it ends before; moves the
// span there. A tile's rows lie together in memory: they are looked at tile by tile.
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

void TraceStaircases(const TileDirectory& directory, std::span<const BitRows> interior,
                     Staircases& staircases) {
  staircases.corners.clear();
  staircases.offsets.assign(1, 0);
  staircases.pinches = 0;
  staircases.visited.assign(interior.size(), BitRows{});
  for (std::uint32_t tile = 0; tile < interior.size(); ++tile) {
    const BitRows edges = BottomEdges(directory, interior, tile);
    BitRows rest;
    for (int j = 0; j < kTileSize; ++j) rest[j] = edges[j] & ~staircases.visited[tile][j];
    if (IsEmpty(rest)) continue;
    for (int j = 0; j < kTileSize; ++j) {
      while ((rest[j] = edges[j] & ~staircases.visited[tile][j]) != 0) {
        TraceLoop(directory, interior, {tile, std::countr_zero(rest[j]), j}, staircases);
      }
    }
  }
  staircases.pinches /= 2;  // Each was passed by both of its cells.
}

std::int64_t EulerCharacteristic(const TileDirectory& directory, const Staircases& staircases) {
  const auto at = [&](std::uint32_t k) {
    const TilePlace& node = staircases.corners[k];
    const TileCoordinate& tile = directory[node.tile];
    return std::pair((std::int64_t{tile.x} << kTileShift) + node.i,
                     (std::int64_t{tile.y} << kTileShift) + node.j);
  };
  auto characteristic = -static_cast<std::int64_t>(staircases.pinches);
  for (std::size_t loop = 0; loop + 1 < staircases.offsets.size(); ++loop) {
    // The area, exact in integers: of an axis-aligned loop the integral of x dy.
    std::int64_t area = 0;
    const std::uint32_t first = staircases.offsets[loop];
    const std::uint32_t last = staircases.offsets[loop + 1];
    const auto origin = at(first);
    for (std::uint32_t k = first; k < last; ++k) {
      const auto a = at(k);
      const auto b = at(k + 1 < last ? k + 1 : first);
      area += (a.first - origin.first) * (b.second - a.second);
    }
    characteristic += area > 0 ? 1 : -1;
  }
  return characteristic;
}

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

void MergeCells(const TileDirectory& directory, std::span<const BitRows> interior,
                MergeScratch& scratch, std::vector<CellRectangle>& rectangles) {
  scratch.free.assign(interior.begin(), interior.end());
  // Tiles are sorted by row: scanning each row of cells through all tiles of a tile row keeps the
  // scan in reading order, so that tile borders leave no trace in the rectangles.
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
