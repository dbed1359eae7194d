#include "space/crossings.h"

#include <algorithm>

#include "base/parallel.h"

namespace partiemc::space {
namespace {

constexpr std::uint64_t kFirstColumn = 0x0101010101010101, kLastColumn = 0x8080808080808080;

/// The inside nodes of a brick and around it.
class NodeLayers {
 public:
  NodeLayers(const BrickDirectory& bricks, const SpaceField& field, std::uint32_t brick)
      : bricks_(bricks), field_(field), brick_(brick) {}

  /// Layer k, -1 <= k <= 8, shifted: bit 8 j + i is node (i + dx, j + dy), -1 <= dx, dy <= 1.
  std::uint64_t operator()(int k, int dx, int dy) const {
    if (dx == 0) return Rows(k, 0, dy);
    const std::uint64_t here = Rows(k, 0, dy), beside = Rows(k, dx, dy);
    return dx > 0 ? (here >> 1 & ~kLastColumn) | (beside << 7 & kLastColumn)
                  : (here << 1 & ~kFirstColumn) | (beside >> 7 & kFirstColumn);
  }

 private:
  /// The bricks in column `bx`, rows shifted by dy.
  std::uint64_t Rows(int k, int bx, int dy) const {
    const std::uint64_t here = Word(bx, 0, k);
    if (dy == 0) return here;
    const std::uint64_t beside = Word(bx, dy, k);
    return dy > 0 ? here >> 8 | beside << 56 : here << 8 | beside >> 56;
  }
  std::uint64_t Word(int bx, int by, int k) const {
    const std::uint32_t owner = bricks_.At(brick_, bx, by, k >> kBrickShift);
    return owner == kNoIndex ? 0 : field_.inside[owner][k & (kBrickSize - 1)];
  }

  const BrickDirectory& bricks_;
  const SpaceField& field_;
  const std::uint32_t brick_;
};

/// Marks crossed edges, the nodes at their ends, and active cells.
void MarkBrick(const BrickDirectory& bricks, const SpaceField& field, std::uint32_t brick,
               SpaceCrossings& crossings) {
  SpaceCrossings::Brick& at = crossings.bricks[brick];
  const NodeLayers nodes(bricks, field, brick);
  std::uint16_t cells = 0;
  for (int k = 0; k < kBrickSize; ++k) {
    const std::uint64_t here = nodes(k, 0, 0);
    at.crossed[0][k] = here ^ nodes(k, 1, 0);
    at.crossed[1][k] = here ^ nodes(k, 0, 1);
    at.crossed[2][k] = here ^ nodes(k + 1, 0, 0);
    crossings.near[brick][k] = at.crossed[0][k] | at.crossed[1][k] | at.crossed[2][k] |
                               (here ^ nodes(k, -1, 0)) | (here ^ nodes(k, 0, -1)) |
                               (here ^ nodes(k - 1, 0, 0));
    std::uint64_t any = 0, all = ~std::uint64_t{0};
    for (int corner = 0; corner < 8; ++corner) {
      const std::uint64_t word = nodes(k + (corner >> 2), corner & 1, corner >> 1 & 1);
      any |= word;
      all &= word;
    }
    at.active[k] = any & ~all;
    at.cells_before[k] = cells;
    cells = static_cast<std::uint16_t>(cells + CountBits(at.active[k]));
  }
  std::uint16_t edges = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < kBrickSize; ++k) {
      at.edges_before[axis][k] = edges;
      edges = static_cast<std::uint16_t>(edges + CountBits(at.crossed[axis][k]));
    }
  }
  at.first_edge = edges;
  at.first_cell = cells;
}

/// Replaces counts by sums.
template <typename CountOf>
std::uint32_t SumUp(std::size_t count, CountOf count_of) {
  std::uint32_t total = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t here = count_of(k);
    count_of(k) = total;
    total += here;
  }
  return total;
}

/// Writes the cells of a brick; sets `loops` to the number of their loops.
void FillCells(const BrickDirectory& bricks, const SpaceField& field, std::uint32_t brick,
               SpaceCrossings& crossings, std::uint32_t& loops) {
  const SpaceCrossings::Brick& at = crossings.bricks[brick];
  std::uint32_t next = at.first_cell;
  loops = 0;
  const NodeLayers nodes(bricks, field, brick);
  for (int k = 0; k < kBrickSize; ++k) {
    if (at.active[k] == 0) continue;
    std::array<std::uint64_t, 8> words;
    for (int corner = 0; corner < 8; ++corner) {
      words[corner] = nodes(k + (corner >> 2), corner & 1, corner >> 1 & 1);
    }
    for (std::uint64_t bits = at.active[k]; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      unsigned corners = 0;
      for (int corner = 0; corner < 8; ++corner) {
        corners |= static_cast<unsigned>(words[corner] >> bit & 1) << corner;
      }
      crossings.cells[next++] = {brick,
                                 static_cast<std::uint8_t>(bit % kBrickSize),
                                 static_cast<std::uint8_t>(bit / kBrickSize),
                                 static_cast<std::uint8_t>(k),
                                 static_cast<std::uint8_t>(corners),
                                 loops};
      loops += LoopsOf(corners).loops;
    }
  }
}

}  // namespace

void FindCrossings(const BrickDirectory& bricks, const SpaceField& field,
                   SpaceCrossings& crossings) {
  const auto count = static_cast<std::uint32_t>(bricks.size());
  crossings.bricks.resize(count);
  crossings.near.resize(count);
  ParallelFor(count, [&](std::uint32_t brick) { MarkBrick(bricks, field, brick, crossings); });
  crossings.edge_count =
      SumUp(count, [&](std::size_t k) -> std::uint32_t& { return crossings.bricks[k].first_edge; });
  const std::uint32_t cells =
      SumUp(count, [&](std::size_t k) -> std::uint32_t& { return crossings.bricks[k].first_cell; });
  crossings.cells.resize(cells);
  crossings.loop_first.resize(count);
  ParallelFor(count, [&](std::uint32_t brick) {
    FillCells(bricks, field, brick, crossings, crossings.loop_first[brick]);
  });
  crossings.loop_count =
      SumUp(count, [&](std::size_t k) -> std::uint32_t& { return crossings.loop_first[k]; });
  ParallelFor(cells, [&](std::uint32_t k) {
    ActiveCell& cell = crossings.cells[k];
    cell.first_loop += crossings.edge_count + crossings.loop_first[cell.brick];
  });
}

}  // namespace partiemc::space
