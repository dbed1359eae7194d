#include "interior.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>
#include <utility>

#include "parallel.h"

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

bool IsInterior(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                const TilePlace& node, int dx, int dy) {
  const TilePlace cell = Normalise(directory, node.tile, node.i + dx, node.j + dy);
  return cell.tile != kNoTile && (tiles[cell.tile].interior[cell.j] >> cell.i & 1) != 0;
}

// The cells of a tile that are interior above a cell that is not.
BitRows BottomEdges(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                    std::uint32_t tile) {
  const BitRows& interior = tiles[tile].interior;
  const std::uint32_t below = directory.neighbours(tile)[1];
  BitRows edges;
  edges[0] = interior[0] & ~(below == kNoTile ? 0 : tiles[below].interior[kTileSize - 1]);
  for (int j = 1; j < kTileSize; ++j) edges[j] = interior[j] & ~interior[j - 1];
  return edges;
}

// Walks one loop that starts eastward along the bottom edge of the cell at `start`.
void TraceLoop(const TileDirectory& directory, const std::vector<TileBits>& tiles, TilePlace start,
               Staircases& staircases) {
  TilePlace node = start;
  int heading = kEast;
  do {
    if (heading == kEast) {
      staircases.visited[node.tile][node.j] |= std::uint32_t{1} << node.i;
    }
    node = Normalise(directory, node.tile, node.i + kStepX[heading], node.j + kStepY[heading]);
    const bool left = IsInterior(directory, tiles, node, kLeftX[heading], kLeftY[heading]);
    const bool right = IsInterior(directory, tiles, node, kRightX[heading], kRightY[heading]);
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

// Cells are taken out this much beyond a box, in cells: a vertex on a lattice line touches the
// cells on both of its sides, and the way from world units rounds.
constexpr double kTouchMargin = 1.0 / 1024;

// Points that a task takes at least.
constexpr std::size_t kExcludeGrain = 256;

// A box in cells of the lattice.
struct CellBox {
  double x0 = std::numeric_limits<double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;

  void Add(const double* point, double cells_per_unit) {
    const double x = point[0] * cells_per_unit;
    const double y = point[1] * cells_per_unit;
    x0 = std::min(x0, x);
    x1 = std::max(x1, x);
    y0 = std::min(y0, y);
    y1 = std::max(y1, y);
  }
  CellBox With(const CellBox& other) const {
    CellBox box;
    box.x0 = std::min(x0, other.x0);
    box.x1 = std::max(x1, other.x1);
    box.y0 = std::min(y0, other.y0);
    box.y1 = std::max(y1, other.y1);
    return box;
  }
};

// The largest integer that is not above `coordinate`; std::floor is a call on old processors.
std::int64_t Floor(double coordinate) {
  const auto whole = static_cast<std::int64_t>(coordinate);
  return whole - (coordinate < static_cast<double>(whole) ? 1 : 0);
}

// Finds tiles; that of the last call, which is the next one's as a rule, without looking for it.
class TileFinder {
 public:
  explicit TileFinder(const TileDirectory& directory) : directory_(directory) {}

  std::uint32_t Find(std::int64_t x, std::int64_t y) {
    const TileCoordinate wanted{static_cast<std::int32_t>(y), static_cast<std::int32_t>(x)};
    if (found_ == kNoTile || wanted != directory_[found_]) found_ = directory_.Find(wanted);
    return found_;
  }

 private:
  const TileDirectory& directory_;
  std::uint32_t found_ = kNoTile;
};

// Takes the cells of one tile that lie in `columns` and rows [first, last] of it out. Several tasks
// may do so at the same time: whoever comes first, the same cells are left.
void ExcludeFromTile(BitRows& interior, std::uint32_t columns, int first, int last) {
  for (int j = first; j <= last; ++j) {
    std::atomic_ref<std::uint32_t> row(interior[j]);
    if ((row.load(std::memory_order_relaxed) & columns) != 0) {
      row.fetch_and(~columns, std::memory_order_relaxed);
    }
  }
}

void ExcludeBox(const CellBox& box, TileFinder& finder, std::vector<TileBits>& tiles) {
  const std::int64_t x0 = Floor(box.x0 - kTouchMargin);
  const std::int64_t x1 = Floor(box.x1 + kTouchMargin);
  const std::int64_t y0 = Floor(box.y0 - kTouchMargin);
  const std::int64_t y1 = Floor(box.y1 + kTouchMargin);
  // The part of [first, last] in the k-th stretch of kTileSize, relative to its start.
  const auto part = [](std::int64_t k, std::int64_t first, std::int64_t last) {
    const std::int64_t start = k << kTileShift;
    return std::pair(static_cast<int>(std::max(first - start, std::int64_t{0})),
                     static_cast<int>(std::min(last - start, std::int64_t{kTileSize - 1})));
  };
  for (std::int64_t row = y0 >> kTileShift; row <= y1 >> kTileShift; ++row) {
    for (std::int64_t column = x0 >> kTileShift; column <= x1 >> kTileShift; ++column) {
      const std::uint32_t tile = finder.Find(column, row);
      if (tile == kNoTile) continue;
      const auto [left, right] = part(column, x0, x1);
      const auto [first, last] = part(row, y0, y1);
      const std::uint32_t columns = (~std::uint32_t{0} >> (kTileSize - 1 - right + left)) << left;
      ExcludeFromTile(tiles[tile].interior, columns, first, last);
    }
  }
}

}  // namespace

void ExcludeTouchedCells(const TileDirectory& directory, std::span<const double> points,
                         std::span<const std::uint32_t> offsets, std::span<const double> roots,
                         double cell_size, std::vector<TileBits>& tiles) {
  const double cells_per_unit = 1 / cell_size;
  ParallelForRanges(points.size() / 2, kExcludeGrain, [&](std::size_t first, std::size_t last) {
    TileFinder finder(directory);
    const auto box_of = [&](std::size_t point) {
      CellBox box;
      box.Add(points.data() + 2 * point, cells_per_unit);
      box.Add(roots.data() + 2 * point, cells_per_unit);
      return box;
    };
    auto after = std::upper_bound(offsets.begin(), offsets.end(), first);
    CellBox box = box_of(first);
    for (std::size_t k = first; k < last; ++k) {
      if (k == *after) {
        while (k == *after) ++after;
        box = box_of(k);
      }
      const CellBox next = box_of(k + 1 == *after ? *(after - 1) : k + 1);
      ExcludeBox(box.With(next), finder, tiles);
      box = next;
    }
  });
}

void TraceStaircases(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                     Staircases& staircases) {
  staircases.corners.clear();
  staircases.offsets.assign(1, 0);
  staircases.pinches = 0;
  staircases.visited.assign(tiles.size(), BitRows{});
  for (std::uint32_t tile = 0; tile < tiles.size(); ++tile) {
    const BitRows edges = BottomEdges(directory, tiles, tile);
    for (int j = 0; j < kTileSize; ++j) {
      while (const std::uint32_t rest = edges[j] & ~staircases.visited[tile][j]) {
        TraceLoop(directory, tiles, {tile, std::countr_zero(rest), j}, staircases);
      }
    }
  }
  staircases.pinches /= 2;  // Each was passed by both of its cells.
}

void MergeCells(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                MergeScratch& scratch, std::vector<CellRectangle>& rectangles) {
  scratch.free.resize(tiles.size());
  for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
    scratch.free[tile] = tiles[tile].interior;
  }
  // Tiles are sorted by row: scanning each row of cells through all tiles of a tile row keeps the
  // scan in reading order, so that tile borders leave no trace in the rectangles.
  for (std::uint32_t first = 0; first < tiles.size();) {
    std::uint32_t last = first;
    while (last < tiles.size() && directory[last].y == directory[first].y) ++last;
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
