#include "space/crossings.h"

#include <algorithm>

#include "base/parallel.h"
#include "space/brick_layers.h"

namespace partiemc::space {
namespace {

/// Marks crossed edges, the nodes at their ends, and active cells.
void MarkBrick(const BrickDirectory& bricks, const SpaceField& field, std::uint32_t brick,
               SpaceCrossings& crossings) {
  SpaceCrossings::Brick& at = crossings.bricks[brick];
  const BrickLayers nodes(bricks, field.inside, brick);
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

/// Replaces each count by the sum of the counts before it. Returns the total.
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

/// Writes the active cells of a brick; sets `loops` to the number of their loops. Each `first_loop`
/// counts from the first loop of the brick.
void FillCells(const BrickDirectory& bricks, const SpaceField& field, std::uint32_t brick,
               SpaceCrossings& crossings, std::uint32_t& loops) {
  const SpaceCrossings::Brick& at = crossings.bricks[brick];
  std::uint32_t next = at.first_cell;
  loops = 0;
  const BrickLayers nodes(bricks, field.inside, brick);
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

void ListSteps(const BrickDirectory& bricks, SpaceCrossings& crossings) {
  crossings.first_step.resize(crossings.loop_count + 1);
  std::uint32_t steps = 0;
  for (const ActiveCell& cell : crossings.cells) {
    const CellLoops& loops = LoopsOf(cell.corners);
    for (int loop = 0; loop < loops.loops; ++loop) {
      crossings.first_step[cell.first_loop - crossings.edge_count + loop] =
          steps + loops.first[loop];
    }
    steps += static_cast<std::uint32_t>(loops.Steps());
  }
  crossings.first_step.back() = steps;
  crossings.step_edges.resize(steps);
  ParallelFor(static_cast<std::uint32_t>(crossings.cells.size()), [&](std::uint32_t index) {
    const ActiveCell& cell = crossings.cells[index];
    const CellLoops& loops = LoopsOf(cell.corners);
    const std::uint32_t first = crossings.FirstStepOf(cell);
    for (int step = 0; step < loops.Steps(); ++step) {
      crossings.step_edges[first + step] = EdgeVertexOf(bricks, crossings, cell, loops.edge[step]);
    }
  });
}

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
