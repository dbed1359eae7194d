#include "space_certificate/moved_nodes.h"

#include "base/parallel.h"

namespace partiemc::space {
namespace {

/// The nodes of a layer with a cell in a brick that does not exist.
std::uint64_t AtTheEnd(const BrickDirectory& bricks, std::uint32_t brick, int k) {
  std::uint64_t nodes = 0;
  for (int side = 1; side < 8; ++side) {
    const int dx = -(side & 1), dy = -(side >> 1 & 1), dz = -(side >> 2);
    if ((dz != 0 && k != 0) || bricks.At(brick, dx, dy, dz) != kNoIndex) continue;
    nodes |= (dx != 0 ? kFirstColumnOfLayer : ~std::uint64_t{0}) &
             (dy != 0 ? std::uint64_t{0xff} : ~std::uint64_t{0});
  }
  return nodes;
}

// Added to squared distances, in squared cells. Keeps weights finite near anchors.
constexpr double kLeastSquare = 1e-3;

bool HasOneLoop(const ActiveCell& cell) { return LoopsOf(cell.corners).loops == 1; }

}  // namespace

std::uint64_t CornersOf(const BrickLayers& cells, int k) {
  std::uint64_t nodes = 0;
  for (int corner = 0; corner < 8; ++corner) {
    nodes |= cells(k - (corner >> 2), -(corner & 1), -(corner >> 1 & 1));
  }
  return nodes;
}

void FindMovedNodes(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                    std::span<const std::uint8_t> is_settled, MovedNodes& nodes) {
  const auto count = static_cast<std::uint32_t>(bricks.size());
  nodes.bricks.resize(count);
  nodes.active.resize(count);
  nodes.movable.resize(count);
  nodes.fixed.assign(count, {});
  for (std::uint32_t brick = 0; brick < count; ++brick) {
    nodes.active[brick] = crossings.bricks[brick].active;
  }
  for (const ActiveCell& cell : crossings.cells) {
    const bool rests = !is_settled.empty() && is_settled[cell.first_loop] != 0;
    const std::uint64_t bit = std::uint64_t{1} << (cell.j * kBrickSize + cell.i);
    if (!HasOneLoop(cell) || rests) nodes.fixed[cell.brick][cell.k] |= bit;
    if (HasOneLoop(cell) && rests) nodes.active[cell.brick][cell.k] &= ~bit;
  }
  ParallelFor(count, [&](std::uint32_t brick) {
    const BrickLayers active(bricks, nodes.active, brick), fixed(bricks, nodes.fixed, brick);
    MovedNodes::Brick& at = nodes.bricks[brick];
    std::uint16_t before = 0;
    for (int k = 0; k < kBrickSize; ++k) {
      at.nodes[k] = CornersOf(active, k) & ~CornersOf(fixed, k) & ~AtTheEnd(bricks, brick, k);
      nodes.movable[brick][k] = at.nodes[k];
      at.before[k] = before;
      before = static_cast<std::uint16_t>(before + CountBits(at.nodes[k]));
    }
    at.first = before;
  });
  nodes.count = 0;
  for (MovedNodes::Brick& brick : nodes.bricks) {
    const std::uint32_t here = brick.first;
    brick.first = nodes.count;
    nodes.count += here;
  }
  ParallelFor(count, [&](std::uint32_t brick) {
    const BrickLayers movable(bricks, nodes.movable, brick);
    for (int k = 0; k < kBrickSize; ++k) {
      std::uint64_t near = nodes.active[brick][k];
      for (int corner = 0; corner < 8; ++corner) {
        near |= movable(k + (corner >> 2), corner & 1, corner >> 1 & 1);
      }
      nodes.bricks[brick].near[k] = near;
    }
  });
  nodes.moves.assign(nodes.count, {});
  nodes.setbacks.assign(nodes.count, 0);
}

BrickBits MoveNodesOf(std::uint32_t brick, const BrickBits& which, const BrickDirectory& bricks,
                      const SpaceCrossings& crossings, double cell_size,
                      const std::vector<Vec3>& anchors, const std::vector<Vec3>& positions,
                      MovedNodes& nodes) {
  BrickBits changed{};
  const Vec3 origin = OriginOf(bricks[brick]);
  const double least = kLeastSquare * cell_size * cell_size;
  ForEachMovedNodeOf(nodes, brick, which, [&](std::uint32_t index, int i, int j, int k) {
    Vec3 sum;
    double total = 0;
    const Vec3 node = cell_size * (origin + Vec3{1.0 * i, 1.0 * j, 1.0 * k});
    const auto add = [&](std::uint32_t v) {
      const Vec3 to = anchors[v] - node;
      const double weight = 1 / (Dot(to, to) + least);
      sum = sum + weight * (positions[v] - anchors[v]);
      total += weight;
    };
    for (int side = 0; side < 8; ++side) {
      const BrickPlace place =
          Normalise(bricks, brick, i - (side & 1), j - (side >> 1 & 1), k - (side >> 2));
      if ((crossings.bricks[place.brick].active[place.k] >> place.Bit() & 1) == 0) continue;
      add(crossings.cells[crossings.CellAt(place)].first_loop);
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (int back = 0; back < 2; ++back) {
        std::array<int, 3> at{i, j, k};
        at[axis] -= back;
        const BrickPlace low = Normalise(bricks, brick, at[0], at[1], at[2]);
        if ((crossings.bricks[low.brick].crossed[axis][low.k] >> low.Bit() & 1) == 0) continue;
        add(crossings.EdgeVertex(low, axis));
      }
    }
    double share = nodes.setbacks[index] < kMostSetbacks ? 1 : 0;
    for (int setback = 0; setback < nodes.setbacks[index]; ++setback) share *= kKeptOfMove;
    const Vec3 move = total > 0 ? (share / total) * sum : Vec3{};
    if (move == nodes.moves[index]) return;
    nodes.moves[index] = move;
    changed[k] |= std::uint64_t{1} << (j * kBrickSize + i);
  });
  return changed;
}

}  // namespace partiemc::space
