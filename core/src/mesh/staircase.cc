#include "mesh/staircase.h"

#include <bit>
#include <utility>

#include "bins/cell_mask.h"

namespace partiemc {
namespace {

enum Heading { kEast = 0, kNorth = 1, kWest = 2, kSouth = 3 };

constexpr int kStepX[4] = {1, 0, -1, 0};
constexpr int kStepY[4] = {0, 1, 0, -1};
// By heading: the cells ahead of a node, on the left and on the right, relative to the node.
constexpr int kLeftX[4] = {0, -1, -1, 0};
constexpr int kLeftY[4] = {0, 0, -1, -1};
constexpr int kRightX[4] = {0, 0, -1, -1};
constexpr int kRightY[4] = {-1, 0, 0, -1};

bool IsInterior(const TileDirectory& directory, std::span<const BitRows> interior,
                const TilePlace& node, int dx, int dy) {
  const TilePlace cell = Normalise(directory, node.tile, node.i + dx, node.j + dy);
  return cell.tile != kNoTile && (interior[cell.tile][cell.j] >> cell.i & 1) != 0;
}

// The interior cells of a tile whose lower neighbour is not interior.
BitRows BottomEdges(const TileDirectory& directory, std::span<const BitRows> interior,
                    std::uint32_t tile) {
  const BitRows& rows = interior[tile];
  const std::uint32_t below = directory.neighbours(tile)[1];
  BitRows edges;
  edges[0] = rows[0] & ~(below == kNoTile ? 0 : interior[below][kTileSize - 1]);
  for (int j = 1; j < kTileSize; ++j) edges[j] = rows[j] & ~rows[j - 1];
  return edges;
}

// Traces one loop, starting to the right along the bottom edge of the cell at `start`.
void TraceLoop(const TileDirectory& directory, std::span<const BitRows> interior,
               const NodeVertices* nodes, const TilePlace& start, Staircases& staircases) {
  TilePlace node = start;
  int heading = kEast;
  do {
    staircases.visited[node.tile][node.j] |= std::uint32_t{heading == kEast} << node.i;
    node = Normalise(directory, node.tile, node.i + kStepX[heading], node.j + kStepY[heading]);
    const bool left = IsInterior(directory, interior, node, kLeftX[heading], kLeftY[heading]);
    const bool right = IsInterior(directory, interior, node, kRightX[heading], kRightY[heading]);
    if (left && !right) {  // Straight on; `continue` evaluates the loop condition.
      if (nodes != nullptr && nodes->Contains(node)) {
        staircases.corners.push_back(node);
        ++staircases.straight_nodes;
      }
      continue;
    }
    if (right && !left) ++staircases.pinches;
    heading = (heading + (left ? 3 : 1)) & 3;
    staircases.corners.push_back(node);
  } while (node.tile != start.tile || node.i != start.i || node.j != start.j || heading != kEast);
  staircases.offsets.push_back(static_cast<std::uint32_t>(staircases.corners.size()));
}

}  // namespace

void TraceStaircases(const TileDirectory& directory, std::span<const BitRows> interior,
                     const NodeVertices* nodes, Staircases& staircases) {
  staircases.corners.clear();
  staircases.offsets.assign(1, 0);
  staircases.straight_nodes = 0;
  staircases.pinches = 0;
  staircases.visited.assign(interior.size(), BitRows{});
  for (std::uint32_t tile = 0; tile < interior.size(); ++tile) {
    const BitRows edges = BottomEdges(directory, interior, tile);
    BitRows rest;
    for (int j = 0; j < kTileSize; ++j) rest[j] = edges[j] & ~staircases.visited[tile][j];
    if (IsEmpty(rest)) continue;
    for (int j = 0; j < kTileSize; ++j) {
      while ((rest[j] = edges[j] & ~staircases.visited[tile][j]) != 0) {
        TraceLoop(directory, interior, nodes, {tile, std::countr_zero(rest[j]), j}, staircases);
      }
    }
  }
  staircases.pinches /= 2;  // Each was passed twice, once along each of its cells.
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
    // The area is the integral of x dy, exact in integers. Its sign distinguishes outlines and
    // voids.
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

}  // namespace partiemc
