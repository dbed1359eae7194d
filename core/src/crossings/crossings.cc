#include "crossings/crossings.h"

#include <algorithm>
#include <bit>

#include "base/bits.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

enum Edge : std::uint8_t { kBottom = 0, kRight = 1, kTop = 2, kLeft = 3 };

struct EdgePair {
  std::uint8_t entry, exit;
};

// By case of a cell: the entry and the exit edge of its segment, with the inside on the left.
// Saddles have two segments, in kSaddles.
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

// Whether the inside corners of a saddle are joined: whether F < 0 at the stationary point of its
// bilinear interpolant, (F0 F2 - F1 F3) / (F0 + F2 - F1 - F3). The denominator is negative in case
// 5 and positive in case 10.
bool AreInsideCornersJoined(const std::array<float, 4>& f, unsigned corners) {
  // Products of two floats are exact in double.
  const double numerator = static_cast<double>(f[0]) * f[2] - static_cast<double>(f[1]) * f[3];
  return corners == 5 ? numerator > 0 : numerator < 0;
}

unsigned CaseOf(const NodeRows& nodes, int i, int j) {
  return (nodes.left[j] >> i & 1) | (nodes.right[j] >> i & 1) << 1 |
         (nodes.right[j + 1] >> i & 1) << 2 | (nodes.left[j + 1] >> i & 1) << 3;
}

// The cells of a tile with all corners inside.
BitRows InteriorCells(const NodeRows& nodes) {
  BitRows interior;
  for (int j = 0; j < kTileSize; ++j) {
    interior[j] = nodes.left[j] & nodes.right[j] & nodes.left[j + 1] & nodes.right[j + 1];
  }
  return interior;
}

// Marks active and interior cells and counts cells and segments.
CrossingCounts ClassifyCells(const TileDirectory& directory, std::uint32_t tile,
                             Crossings& crossings) {
  const NodeRows nodes = InsideRows(directory, crossings.tiles, tile);
  TileBits& bits = crossings.tiles[tile];
  const BitRows interior = crossings.interior[tile] = InteriorCells(nodes);
  BitRows saddles;
  std::uint32_t any_active = 0;
  for (int j = 0; j < kTileSize; ++j) {
    const std::uint32_t any =
        nodes.left[j] | nodes.right[j] | nodes.left[j + 1] | nodes.right[j + 1];
    bits.active[j] = any & ~interior[j];
    any_active |= bits.active[j];
    saddles[j] = (nodes.left[j] ^ nodes.right[j]) & (nodes.left[j] ^ nodes.left[j + 1]) &
                 (nodes.right[j] ^ nodes.right[j + 1]);
  }
  CrossingCounts counts;
  if (any_active == 0) return counts;
  for (int j = 0; j < kTileSize; ++j) {
    bits.row_cells[j] = static_cast<std::uint16_t>(counts.cells);
    const int cells = CountBits(bits.active[j]);
    counts.cells += static_cast<std::uint32_t>(cells);
    counts.segments += static_cast<std::uint32_t>(cells + CountBits(saddles[j]));
  }
  return counts;
}

// Writes the cells and segments of a tile from index `next` on.
void FillTile(const TileDirectory& directory, const LevelSet& level_set, std::uint32_t tile,
              CrossingCounts next, Crossings& crossings) {
  const NodeRows nodes = InsideRows(directory, crossings.tiles, tile);
  for (int j = 0; j < kTileSize; ++j) {
    for (std::uint32_t bits = crossings.tiles[tile].active[j]; bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      ActiveCell& cell = crossings.cells[next.cells];
      cell = {tile,
              static_cast<std::uint8_t>(i),
              static_cast<std::uint8_t>(j),
              static_cast<std::uint8_t>(CaseOf(nodes, i, j)),
              0,
              next.segments};
      if (cell.IsSaddle()) {
        const std::array<float, 4> f = {
            level_set.At(directory, tile, i, j), level_set.At(directory, tile, i + 1, j),
            level_set.At(directory, tile, i + 1, j + 1), level_set.At(directory, tile, i, j + 1)};
        cell.joined = AreInsideCornersJoined(f, cell.corners);
        for (const EdgePair& pair : kSaddles[cell.corners == 10][cell.joined]) {
          crossings.segments[next.segments++] = {next.cells, pair.entry, pair.exit};
        }
      } else {
        const EdgePair& pair = kSegments[cell.corners];
        crossings.segments[next.segments++] = {next.cells, pair.entry, pair.exit};
      }
      ++next.cells;
    }
  }
}

}  // namespace

NodeRows InsideRows(const TileDirectory& directory, const std::vector<TileBits>& tiles,
                    std::uint32_t tile) {
  const Neighbourhood& near = directory.neighbours(tile);
  const auto row = [&](std::uint32_t owner, int j) {
    return owner == kNoTile ? 0 : tiles[owner].inside[j];
  };
  NodeRows nodes;
  std::copy(tiles[tile].inside.begin(), tiles[tile].inside.end(), nodes.left.begin());
  nodes.left[kTileSize] = row(near[7], 0);
  for (int j = 0; j <= kTileSize; ++j) nodes.right[j] = nodes.left[j] >> 1;
  if (const std::uint32_t right = near[5]; right != kNoTile) {
    for (int j = 0; j < kTileSize; ++j) nodes.right[j] |= tiles[right].inside[j] << (kTileSize - 1);
  }
  nodes.right[kTileSize] |= row(near[8], 0) << (kTileSize - 1);
  return nodes;
}

void FindCrossings(const TileDirectory& directory, const LevelSet& level_set,
                   Crossings& crossings) {
  const auto tile_count = static_cast<std::uint32_t>(directory.size());
  crossings.tiles.resize(tile_count);
  crossings.interior.resize(tile_count);
  ParallelFor(tile_count,
              [&](std::uint32_t tile) { crossings.tiles[tile].inside = level_set.inside[tile]; });

  std::vector<CrossingCounts>& counts = crossings.counts;
  counts.resize(tile_count + 1);
  ParallelFor(tile_count, [&](std::uint32_t tile) {
    counts[tile] = ClassifyCells(directory, tile, crossings);
  });
  CrossingCounts total;
  for (std::uint32_t tile = 0; tile < tile_count; ++tile) {
    const CrossingCounts here = counts[tile];
    counts[tile] = total;
    crossings.tiles[tile].first_cell = total.cells;
    total = {total.cells + here.cells, total.segments + here.segments};
  }
  counts[tile_count] = total;

  crossings.cells.resize(total.cells);
  crossings.segments.resize(total.segments);
  ParallelFor(tile_count, [&](std::uint32_t tile) {
    if (counts[tile].cells == counts[tile + 1].cells) return;
    FillTile(directory, level_set, tile, counts[tile], crossings);
  });
}

void MarkInteriorCells(const TileDirectory& directory, Crossings& crossings) {
  ParallelFor(static_cast<std::uint32_t>(directory.size()), [&](std::uint32_t tile) {
    crossings.interior[tile] = InteriorCells(InsideRows(directory, crossings.tiles, tile));
  });
}

void JoinSaddle(Crossings& crossings, std::uint32_t cell) {
  ActiveCell& saddle = crossings.cells[cell];
  saddle.joined = 1;
  std::uint32_t segment = saddle.first_segment;
  for (const EdgePair& pair : kSaddles[saddle.corners == 10][1]) {
    crossings.segments[segment++] = {cell, pair.entry, pair.exit};
  }
}

std::uint32_t CellAt(const Crossings& crossings, const TilePlace& place) {
  const TileBits& bits = crossings.tiles[place.tile];
  const std::uint32_t before = (std::uint32_t{1} << place.i) - 1;
  return bits.first_cell + bits.row_cells[place.j] +
         static_cast<std::uint32_t>(CountBits(bits.active[place.j] & before));
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

}  // namespace partiemc
