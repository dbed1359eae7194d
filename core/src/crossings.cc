#include "crossings.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>

namespace partiemc {
namespace {

enum Edge : std::uint8_t { kBottom = 0, kRight = 1, kTop = 2, kLeft = 3 };

struct EdgePair {
  std::uint8_t entry, exit;
};

// Entry and exit of a cell's first segment by its case, inside on the left. A saddle's rows are
// replaced by kSaddles.
constexpr std::array<EdgePair, 16> kSegments = {{
    {0, 0},             // 0: all outside
    {kBottom, kLeft},   // 1: corner 0
    {kRight, kBottom},  // 2: corner 1
    {kRight, kLeft},    // 3: corners 0 1
    {kTop, kRight},     // 4: corner 2
    {0, 0},             // 5: saddle
    {kTop, kBottom},    // 6: corners 1 2
    {kTop, kLeft},      // 7: all but 3
    {kLeft, kTop},      // 8: corner 3
    {kBottom, kTop},    // 9: corners 0 3
    {0, 0},             // 10: saddle
    {kRight, kTop},     // 11: all but 2
    {kLeft, kRight},    // 12: corners 2 3
    {kBottom, kRight},  // 13: all but 1
    {kLeft, kBottom},   // 14: all but 0
    {0, 0},             // 15: all inside
}};

//   case 5 parted   joined      case 10 parted   joined
//    o---#           o---#           #---o       #---o      # inside
//    |  \|           |/  |           |/  |       |  \|
//    |\  |           |  /|           |  /|       |\  |
//    #---o           #---o           o---#       o---#
constexpr EdgePair kSaddles[2][2][2] = {
    {{{kBottom, kLeft}, {kTop, kRight}}, {{kBottom, kRight}, {kTop, kLeft}}},   // 5: parted, joined
    {{{kRight, kBottom}, {kLeft, kTop}}, {{kLeft, kBottom}, {kRight, kTop}}}};  // 10

// A crossing keeps at least this share of its edge between itself and either node.
constexpr double kEdgeMargin = 1.0 / 4096;

// Whether the inside corners of a saddle are joined: the sign of F where its bilinear interpolant
// is stationary, (F0 F2 - F1 F3) / (F0 + F2 - F1 - F3). 0 counts as outside, here too.
bool AreInsideCornersJoined(const std::array<float, 4>& f, unsigned corners) {
  // Products of two floats are exact in double.
  const double numerator = static_cast<double>(f[0]) * f[2] - static_cast<double>(f[1]) * f[3];
  return corners == 5 ? numerator > 0 : numerator < 0;
}

unsigned CaseOf(const NodeRow& lower, const NodeRow& upper, int i) {
  return (lower.left >> i & 1) | (lower.right >> i & 1) << 1 | (upper.right >> i & 1) << 2 |
         (upper.left >> i & 1) << 3;
}

// Marks active and interior cells and counts cells and segments.
CrossingCounts ClassifyCells(const TileDirectory& directory, std::vector<TileBits>& tiles,
                             std::uint32_t tile) {
  CrossingCounts counts;
  NodeRow lower = InsideRow(directory, tiles, tile, 0);
  for (int j = 0; j < kTileSize; ++j) {
    const NodeRow upper = InsideRow(directory, tiles, tile, j + 1);
    const std::uint32_t any = lower.left | lower.right | upper.left | upper.right;
    const std::uint32_t all = lower.left & lower.right & upper.left & upper.right;
    const std::uint32_t active = any & ~all;
    const std::uint32_t saddles =
        (lower.left ^ lower.right) & (lower.left ^ upper.left) & (lower.right ^ upper.right);
    tiles[tile].active[j] = active;
    tiles[tile].interior[j] = all;
    counts.cells += static_cast<std::uint32_t>(std::popcount(active));
    counts.segments += static_cast<std::uint32_t>(std::popcount(active) + std::popcount(saddles));
    lower = upper;
  }
  return counts;
}

void FillTile(const TileDirectory& directory, const LevelSet& level_set, std::uint32_t tile,
              std::uint32_t segment, Crossings& crossings) {
  std::uint32_t cell_index = crossings.tiles[tile].first_cell;
  for (int j = 0; j < kTileSize; ++j) {
    const NodeRow lower = InsideRow(directory, crossings.tiles, tile, j);
    const NodeRow upper = InsideRow(directory, crossings.tiles, tile, j + 1);
    for (std::uint32_t bits = crossings.tiles[tile].active[j]; bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      ActiveCell& cell = crossings.cells[cell_index];
      cell = {tile,
              static_cast<std::uint8_t>(i),
              static_cast<std::uint8_t>(j),
              static_cast<std::uint8_t>(CaseOf(lower, upper, i)),
              0,
              segment};
      if (cell.IsSaddle()) {
        const std::array<float, 4> f = {
            level_set.At(directory, tile, i, j), level_set.At(directory, tile, i + 1, j),
            level_set.At(directory, tile, i + 1, j + 1), level_set.At(directory, tile, i, j + 1)};
        cell.joined = AreInsideCornersJoined(f, cell.corners);
        for (const EdgePair& pair : kSaddles[cell.corners == 10][cell.joined]) {
          crossings.segments[segment++] = {cell_index, pair.entry, pair.exit};
        }
      } else {
        const EdgePair& pair = kSegments[cell.corners];
        crossings.segments[segment++] = {cell_index, pair.entry, pair.exit};
      }
      ++cell_index;
    }
  }
}

template <typename Visit>
void ForEachTile(std::size_t count, Visit visit) {
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, static_cast<std::uint32_t>(count)),
                    [&](const tbb::blocked_range<std::uint32_t>& range) {
                      for (std::uint32_t tile = range.begin(); tile < range.end(); ++tile) {
                        visit(tile);
                      }
                    });
}

}  // namespace

NodeRow InsideRow(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                  std::uint32_t tile, int j) {
  const Neighbourhood& near = directory.neighbours(tile);
  const bool above = j == kTileSize;
  const std::uint32_t here = near[above ? 7 : 4];
  const std::uint32_t right = near[above ? 8 : 5];
  const int row = above ? 0 : j;
  NodeRow result;
  if (here != kNoTile) result.left = tiles[here].inside[row];
  result.right = result.left >> 1;
  if (right != kNoTile) result.right |= tiles[right].inside[row] << (kTileSize - 1);
  return result;
}

void FindCrossings(const TileDirectory& directory, const LevelSet& level_set,
                   Crossings& crossings) {
  const std::size_t tile_count = directory.size();
  crossings.tiles.resize(tile_count);
  ForEachTile(tile_count,
              [&](std::uint32_t tile) { crossings.tiles[tile].inside = level_set.inside[tile]; });

  std::vector<CrossingCounts>& counts = crossings.counts;
  counts.resize(tile_count);
  ForEachTile(tile_count, [&](std::uint32_t tile) {
    counts[tile] = ClassifyCells(directory, crossings.tiles, tile);
  });
  CrossingCounts total;
  for (std::size_t tile = 0; tile < tile_count; ++tile) {
    const CrossingCounts here = counts[tile];
    counts[tile] = total;
    crossings.tiles[tile].first_cell = total.cells;
    total = {total.cells + here.cells, total.segments + here.segments};
  }

  crossings.cells.resize(total.cells);
  crossings.segments.resize(total.segments);
  ForEachTile(tile_count, [&](std::uint32_t tile) {
    FillTile(directory, level_set, tile, counts[tile].segments, crossings);
  });
}

void MarkInteriorCells(const TileDirectory& directory, Crossings& crossings) {
  ForEachTile(directory.size(), [&](std::uint32_t tile) {
    NodeRow lower = InsideRow(directory, crossings.tiles, tile, 0);
    for (int j = 0; j < kTileSize; ++j) {
      const NodeRow upper = InsideRow(directory, crossings.tiles, tile, j + 1);
      crossings.tiles[tile].interior[j] = lower.left & lower.right & upper.left & upper.right;
      lower = upper;
    }
  });
}

std::uint32_t CellAt(const Crossings& crossings, const TilePlace& place) {
  const TileBits& bits = crossings.tiles[place.tile];
  std::uint32_t index = bits.first_cell;
  for (int j = 0; j < place.j; ++j) {
    index += static_cast<std::uint32_t>(std::popcount(bits.active[j]));
  }
  const std::uint32_t before = (std::uint32_t{1} << place.i) - 1;
  return index + static_cast<std::uint32_t>(std::popcount(bits.active[place.j] & before));
}

std::uint32_t NextSegment(const TileDirectory& directory, const Crossings& crossings,
                          std::uint32_t segment) {
  constexpr int kStepX[4] = {0, 1, 0, -1};
  constexpr int kStepY[4] = {-1, 0, 1, 0};
  const Segment& here = crossings.segments[segment];
  const ActiveCell& cell = crossings.cells[here.cell];
  const TilePlace place =
      Normalise(directory, cell.tile, cell.i + kStepX[here.exit], cell.j + kStepY[here.exit]);
  const std::uint32_t next = crossings.cells[CellAt(crossings, place)].first_segment;
  const std::uint8_t entry = (here.exit + 2) & 3;
  return crossings.segments[next].entry == entry ? next : next + 1;
}

LatticePoint CellOrigin(const TileDirectory& directory, const ActiveCell& cell) {
  const TileCoordinate& tile = directory[cell.tile];
  return {static_cast<double>((std::int64_t{tile.x} << kTileShift) + cell.i),
          static_cast<double>((std::int64_t{tile.y} << kTileShift) + cell.j)};
}

LatticePoint EdgeCrossing(const TileDirectory& directory, const LevelSet& level_set,
                          const ActiveCell& cell, int edge) {
  // Every edge is walked from its lower or left node, so that both cells compute the same.
  constexpr int kNodeX[4] = {0, 1, 0, 0};
  constexpr int kNodeY[4] = {0, 0, 1, 0};
  const int i = cell.i + kNodeX[edge];
  const int j = cell.j + kNodeY[edge];
  const bool horizontal = edge == kBottom || edge == kTop;
  const double a = level_set.At(directory, cell.tile, i, j);
  const double b = level_set.At(directory, cell.tile, i + horizontal, j + !horizontal);
  const double t = std::clamp(a / (a - b), kEdgeMargin, 1 - kEdgeMargin);
  LatticePoint point = CellOrigin(directory, cell);
  point.x += kNodeX[edge] + (horizontal ? t : 0);
  point.y += kNodeY[edge] + (horizontal ? 0 : t);
  return point;
}

}  // namespace partiemc
