#include "mesh/touched_cells.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <utility>

#include "base/parallel.h"

namespace partiemc {
namespace {

// Cells are taken out this much beyond a box, in cells: a vertex on a lattice line touches the
// cells on both of its sides, and the way from world units rounds.
constexpr double kTouchMargin = 1.0 / 1024;

// Points that a task takes at least.
constexpr std::size_t kExcludeGrain = 256;

// Rows of cells that a box is taken to touch without asking whether it does.
constexpr int kUsualRows = 4;

// Points whose cells are found together.
constexpr std::size_t kPointsAtOnce = 64;

// Cells of the lattice, the last ones included: columns, rows.
struct CellRange {
  std::array<std::int64_t, 2> first, last;

  CellRange With(const CellRange& other) const {
    CellRange both;
    for (int axis = 0; axis < 2; ++axis) {
      both.first[axis] = std::min(first[axis], other.first[axis]);
      both.last[axis] = std::max(last[axis], other.last[axis]);
    }
    return both;
  }
};

// The largest integer that is not above `coordinate`, of a magnitude below 2^51. Without a branch
// or a conversion, so that compilers make vectors of it: a sum with kRounder is rounded to an
// integer, which stands in its lowest bits.
std::int64_t Floor(double coordinate) {
  constexpr double kRounder = 0x1.8p52;
  const double sum = coordinate + kRounder;
  const double beyond = coordinate - (sum - kRounder);  // Exact; below 0 if it was rounded up.
  return static_cast<std::int64_t>(std::bit_cast<std::uint64_t>(sum) -
                                   std::bit_cast<std::uint64_t>(kRounder) -
                                   (std::bit_cast<std::uint64_t>(beyond) >> 63));
}

// The cells from each of some points to its root, and those that they touch.
void FindCells(std::span<const double> points, std::span<const double> roots, double cells_per_unit,
               std::span<CellRange> ranges) {
  std::array<std::int64_t, 2 * kPointsAtOnce> firsts, lasts;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double point = points[k] * cells_per_unit;
    const double root = roots[k] * cells_per_unit;
    firsts[k] = Floor(std::min(point, root) - kTouchMargin);
    lasts[k] = Floor(std::max(point, root) + kTouchMargin);
  }
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    ranges[k] = {{firsts[2 * k], firsts[2 * k + 1]}, {lasts[2 * k], lasts[2 * k + 1]}};
  }
}

// Columns [left, right] of a row of a tile.
std::uint32_t ColumnBits(int left, int right) {
  return (~std::uint32_t{0} >> (kTileSize - 1 - right + left)) << left;
}

// Takes cells out of the interior. Boxes that follow each other lie in one tile as a rule: their
// cells are collected and taken out together. Several tasks may do so at the same time: whoever
// comes first, the same cells are left.
class CellTaker {
 public:
  CellTaker(const TileDirectory& directory, std::span<BitRows> interior)
      : directory_(directory), interior_(interior) {}

  /// Takes a range of cells out.
  void Take(const CellRange& range);

  /// Takes out what has been collected.
  void Finish();

 private:
  void TakeFromTiles(const CellRange& range);
  std::uint32_t TileAt(std::int64_t column, std::int64_t row) const;
  void MoveTo(std::uint32_t tile);

  const TileDirectory& directory_;
  std::span<BitRows> interior_;
  std::uint32_t tile_ = kNoTile;                                   // Of which cells are collected.
  std::int64_t origin_x_ = 0, origin_y_ = 0;                       // Its lower left cell.
  std::array<std::uint32_t, kTileSize + kUsualRows> collected_{};  // The last rows stay empty.
};

void Clear(std::uint32_t& row, std::uint32_t columns) {
  std::atomic_ref<std::uint32_t> cells(row);
  if ((cells.load(std::memory_order_relaxed) & columns) == 0) return;
  cells.fetch_and(~columns, std::memory_order_relaxed);
}

inline void CellTaker::Take(const CellRange& range) {
  const std::int64_t left = range.first[0] - origin_x_, right = range.last[0] - origin_x_;
  const std::int64_t first = range.first[1] - origin_y_, last = range.last[1] - origin_y_;
  const bool is_in_tile = (left | first | (kTileSize - 1 - right) | (kTileSize - 1 - last)) >= 0;
  if (!is_in_tile || tile_ == kNoTile) {
    TakeFromTiles(range);
    return;
  }
  const std::uint32_t columns = ColumnBits(static_cast<int>(left), static_cast<int>(right));
  std::uint32_t* const rows = collected_.data() + first;
  const int count = static_cast<int>(last - first) + 1;
  for (int k = 0; k < kUsualRows; ++k) rows[k] |= k < count ? columns : 0;
  for (int k = kUsualRows; k < count; ++k) rows[k] |= columns;
}

// Goes to the tile that a range lies in; takes its cells out of each that it meets.
void CellTaker::TakeFromTiles(const CellRange& range) {
  const auto& [x0, y0] = range.first;
  const auto& [x1, y1] = range.last;
  // The part of [first, last] in the k-th stretch of kTileSize, relative to its start.
  const auto part = [](std::int64_t k, std::int64_t first, std::int64_t last) {
    const std::int64_t start = k << kTileShift;
    return std::pair(static_cast<int>(std::max(first - start, std::int64_t{0})),
                     static_cast<int>(std::min(last - start, std::int64_t{kTileSize - 1})));
  };
  const bool is_one = x0 >> kTileShift == x1 >> kTileShift && y0 >> kTileShift == y1 >> kTileShift;
  for (std::int64_t row = y0 >> kTileShift; row <= y1 >> kTileShift; ++row) {
    for (std::int64_t column = x0 >> kTileShift; column <= x1 >> kTileShift; ++column) {
      const std::uint32_t tile = TileAt(column, row);
      if (tile == kNoTile) continue;
      if (is_one) MoveTo(tile);
      const auto [left, right] = part(column, x0, x1);
      const auto [first, last] = part(row, y0, y1);
      for (int j = first; j <= last; ++j) {
        Clear(interior_[tile][j], ColumnBits(left, right));
      }
    }
  }
}

// Looked up only where it is not next to the tile of the range before.
std::uint32_t CellTaker::TileAt(std::int64_t column, std::int64_t row) const {
  const std::int64_t dx = column - (origin_x_ >> kTileShift);
  const std::int64_t dy = row - (origin_y_ >> kTileShift);
  if (tile_ != kNoTile && -1 <= dx && dx <= 1 && -1 <= dy && dy <= 1) {
    return directory_.neighbours(tile_)[static_cast<std::size_t>((dy + 1) * 3 + dx + 1)];
  }
  return directory_.Find({static_cast<std::int32_t>(row), static_cast<std::int32_t>(column)});
}

void CellTaker::MoveTo(std::uint32_t tile) {
  Finish();
  tile_ = tile;
  origin_x_ = std::int64_t{directory_[tile].x} << kTileShift;
  origin_y_ = std::int64_t{directory_[tile].y} << kTileShift;
}

void CellTaker::Finish() {
  if (tile_ == kNoTile) return;
  for (int j = 0; j < kTileSize; ++j) {
    if (collected_[j] != 0) Clear(interior_[tile_][j], collected_[j]);
  }
  collected_.fill(0);
}

}  // namespace

void ExcludeTouchedCells(const TileDirectory& directory, std::span<const double> points,
                         std::span<const std::uint32_t> offsets, std::span<const double> roots,
                         double cell_size, std::span<BitRows> interior) {
  const double cells_per_unit = 1 / cell_size;
  ParallelForRanges(points.size() / 2, kExcludeGrain, [&](std::size_t first, std::size_t last) {
    CellTaker taker(directory, interior);
    std::array<CellRange, kPointsAtOnce> ranges;
    const auto find = [&](std::size_t point, std::size_t count, CellRange* found) {
      FindCells(points.subspan(2 * point, 2 * count), roots.subspan(2 * point, 2 * count),
                cells_per_unit, {found, count});
    };
    auto ring_end = std::upper_bound(offsets.begin(), offsets.end(), first);
    for (std::size_t begin = first; begin < last;) {
      while (begin == *ring_end) ++ring_end;
      // Segments, each with the point behind it: of a ring's last one, that is the first.
      const std::size_t end = std::min({begin + kPointsAtOnce - 1, last, std::size_t{*ring_end}});
      const std::size_t count = end - begin;
      find(begin, count, ranges.data());
      find(end == *ring_end ? *(ring_end - 1) : end, 1, &ranges[count]);
      for (std::size_t k = 0; k < count; ++k) taker.Take(ranges[k].With(ranges[k + 1]));
      begin = end;
    }
    taker.Finish();
  });
}

}  // namespace partiemc
