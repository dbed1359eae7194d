#include "mesh/touched_cells.h"

#include <algorithm>
#include <atomic>

#include "base/parallel.h"

namespace partiemc {
namespace {

// Margin around the box of a segment, in cells. A vertex on a lattice line touches the cells on
// both sides, and the conversion from world units rounds.
constexpr double kTouchMargin = 1.0 / 1024;

// Smallest number of points of a task.
constexpr std::size_t kExcludeGrain = 256;

// A rectangle of cells, including `right` and `top`.
struct CellRange {
  std::int64_t left, bottom, right, top;
};

// Replaces std::floor, which is a function call unless the build targets SSE4.1.
std::int64_t Floor(double coordinate) {
  const auto integer = static_cast<std::int64_t>(coordinate);
  return integer - (static_cast<double>(integer) > coordinate ? 1 : 0);
}

// The cells that the box of a point and its root touches.
CellRange CellsOf(const double* point, const double* root, double cells_per_unit) {
  const double x0 = point[0] * cells_per_unit, x1 = root[0] * cells_per_unit;
  const double y0 = point[1] * cells_per_unit, y1 = root[1] * cells_per_unit;
  return {Floor(std::min(x0, x1) - kTouchMargin), Floor(std::min(y0, y1) - kTouchMargin),
          Floor(std::max(x0, x1) + kTouchMargin), Floor(std::max(y0, y1) + kTouchMargin)};
}

CellRange Around(const CellRange& a, const CellRange& b) {
  return {std::min(a.left, b.left), std::min(a.bottom, b.bottom), std::max(a.right, b.right),
          std::max(a.top, b.top)};
}

// Clears cells of the interior. Tasks clear bits atomically, so their order has no effect.
class CellClearer {
 public:
  CellClearer(const TileDirectory& directory, std::span<BitRows> interior)
      : directory_(directory), interior_(interior) {}

  void Clear(const CellRange& range) {
    if (ClearHere(range)) return;
    for (std::int64_t y = range.bottom >> kTileShift; y <= range.top >> kTileShift; ++y) {
      for (std::int64_t x = range.left >> kTileShift; x <= range.right >> kTileShift; ++x) {
        tile_ = directory_.Find({static_cast<std::int32_t>(y), static_cast<std::int32_t>(x)});
        origin_x_ = x << kTileShift;
        origin_y_ = y << kTileShift;
        constexpr std::int64_t kLast = kTileSize - 1;
        ClearHere({std::max(range.left, origin_x_), std::max(range.bottom, origin_y_),
                   std::min(range.right, origin_x_ + kLast),
                   std::min(range.top, origin_y_ + kLast)});
      }
    }
  }

 private:
  // Clears the range if it lies in the current tile, which is the common case; else returns false.
  bool ClearHere(const CellRange& range) {
    if (tile_ == kNoTile) return false;
    const std::int64_t left = range.left - origin_x_, right = range.right - origin_x_;
    const std::int64_t bottom = range.bottom - origin_y_, top = range.top - origin_y_;
    if ((left | bottom | (kTileSize - 1 - right) | (kTileSize - 1 - top)) < 0) return false;
    const std::uint32_t columns = (~std::uint32_t{0} >> (kTileSize - 1 - right + left)) << left;
    for (std::int64_t j = bottom; j <= top; ++j) {
      std::atomic_ref<std::uint32_t> cells(interior_[tile_][j]);
      if ((cells.load(std::memory_order_relaxed) & columns) == 0) continue;
      cells.fetch_and(~columns, std::memory_order_relaxed);
    }
    return true;
  }

  const TileDirectory& directory_;
  std::span<BitRows> interior_;
  std::uint32_t tile_ = kNoTile;              // The current tile: the tile of the last range.
  std::int64_t origin_x_ = 0, origin_y_ = 0;  // Its lower left cell.
};

}  // namespace

void ExcludeTouchedCells(const TileDirectory& directory, std::span<const double> points,
                         std::span<const std::uint32_t> offsets, std::span<const double> roots,
                         double cell_size, std::span<BitRows> interior) {
  const double cells_per_unit = 1 / cell_size;
  ParallelForRanges(points.size() / 2, kExcludeGrain, [&](std::size_t first, std::size_t last) {
    CellClearer clearer(directory, interior);
    const auto cells_of = [&](std::size_t point) {
      return CellsOf(&points[2 * point], &roots[2 * point], cells_per_unit);
    };
    auto ring_end = std::upper_bound(offsets.begin(), offsets.end(), first);
    CellRange cells = cells_of(first);
    for (std::size_t point = first; point < last; ++point) {
      const bool is_last = point + 1 == *ring_end;
      const CellRange next = cells_of(is_last ? *(ring_end - 1) : point + 1);
      clearer.Clear(Around(cells, next));
      cells = next;
      if (!is_last || point + 1 == last) continue;
      while (*ring_end == point + 1) ++ring_end;
      cells = cells_of(point + 1);
    }
  });
}

}  // namespace partiemc
