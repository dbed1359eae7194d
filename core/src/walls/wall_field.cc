#include "walls/wall_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"

namespace partiemc {
namespace {

// Nodes deeper in the solid than this, in cells, need no value of the fluid: no lattice edge joins
// them to the outside of a wall.
constexpr float kMostDepth = 1.5F;
// Limit of the coordinates of tiles.
constexpr double kMostTiles = 1 << 30;

Point OriginOf(const TileDirectory& directory, std::uint32_t tile) {
  return {static_cast<double>(std::int64_t{directory[tile].x} << kTileShift),
          static_cast<double>(std::int64_t{directory[tile].y} << kTileShift)};
}

// F at a point of a tile and its neighbours, by bilinear interpolation.
double Interpolate(const TileDirectory& directory, const LevelSet& level_set, std::uint32_t tile,
                   Point point) {
  const Point origin = OriginOf(directory, tile);
  const double x = std::clamp<double>(point.x - origin.x, -kTileSize, 2 * kTileSize - 1.001);
  const double y = std::clamp<double>(point.y - origin.y, -kTileSize, 2 * kTileSize - 1.001);
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  const double u = x - i, v = y - j;
  const auto at = [&](int di, int dj) -> double {
    const TilePlace node = Normalise(directory, tile, i + di, j + dj);
    return node.tile == kNoTile ? level_set.void_value
                                : level_set.tiles[node.tile][node.j * kTileSize + node.i];
  };
  return (1 - v) * ((1 - u) * at(0, 0) + u * at(1, 0)) + v * ((1 - u) * at(0, 1) + u * at(1, 1));
}

// Bit i of the result is set if i < `end`.
std::uint32_t BitsBelow(double end) {
  if (!(end > 0)) return 0;
  return end >= kTileSize ? ~std::uint32_t{0} : (std::uint32_t{1} << static_cast<int>(end)) - 1;
}

// The nodes of a tile in a solid. As WallLines::IsSolid, for all nodes at once.
BitRows SolidNodes(const WallLines& lines, std::size_t solid, const Point& origin) {
  BitRows rows{};
  const auto edges = lines.EdgesOfSolid(solid);
  if (edges.front().is_endless) {
    for (int node = 0; node < kTileNodes; ++node) {
      const Point at{origin.x + node % kTileSize, origin.y + node / kTileSize};
      rows[node / kTileSize] |= std::uint32_t{lines.IsSolid(solid, at)} << node % kTileSize;
    }
    return rows;
  }
  if (!lines.IsSolidInside(solid)) rows.fill(~std::uint32_t{0});
  for (const WallEdge& edge : edges) {
    const double low = std::min(edge.from.y, edge.to.y) - origin.y;
    const double high = std::max(edge.from.y, edge.to.y) - origin.y;
    for (int j = low > 0 ? static_cast<int>(std::min<double>(std::ceil(low), kTileSize)) : 0;
         j < kTileSize && j < high; ++j) {
      const double share = (origin.y + j - edge.from.y) / (edge.to.y - edge.from.y);
      const double x = edge.from.x + share * (edge.to.x - edge.from.x) - origin.x;
      rows[j] ^= BitsBelow(std::ceil(x));
    }
  }
  return rows;
}

// Lowers the distances of the nodes of a tile to a line.
void MeasureDistances(const WallLines& lines, std::uint32_t edge, const Point& origin,
                      std::array<float, kTileNodes>& distance) {
  const WallEdge& line = lines.edges()[edge];
  const auto range = [&](double a, double b, double from) -> std::pair<int, int> {
    if (line.is_endless) return {0, kTileSize};
    const auto clamped = [](double at) {
      return static_cast<int>(std::clamp<double>(at, 0, kTileSize));
    };
    return {clamped(std::min(a, b) - from - WallField::kMostHeight),
            clamped(std::max(a, b) - from + WallField::kMostHeight + 1)};
  };
  const auto [left, right] = range(line.from.x, line.to.x, origin.x);
  const auto [low, high] = range(line.from.y, line.to.y, origin.y);
  for (int j = low; j < high; ++j) {
    for (int i = left; i < right; ++i) {
      const Point node{origin.x + i, origin.y + j};
      float& at = distance[j * kTileSize + i];
      at = std::min(at, static_cast<float>(std::abs(lines.NearestOn(edge, node).height)));
    }
  }
}

}  // namespace

// Pairs each line with the tiles that it is near to.
void WallField::ListLines(const TileDirectory& directory) {
  constexpr double kRadius = kTileSize * .7072;  // Half the diagonal of a tile.
  constexpr double kMargin = kRadius + kMostHeight;
  pairs_.clear();
  const auto add_if_near = [&](std::uint32_t tile, std::uint32_t line) {
    const Point origin = OriginOf(directory, tile);
    const Point middle{origin.x + kTileSize / 2.0, origin.y + kTileSize / 2.0};
    if (std::abs(lines_.NearestOn(line, middle).height) <= kMargin) pairs_.emplace_back(tile, line);
  };
  for (std::uint32_t line = 0; line < lines_.edges().size(); ++line) {
    const WallEdge& edge = lines_.edges()[line];
    const auto tile_of = [](double at) { return std::floor(at / kTileSize); };
    const double left = tile_of(std::min(edge.from.x, edge.to.x) - kMostHeight);
    const double right = tile_of(std::max(edge.from.x, edge.to.x) + kMostHeight);
    const double low = tile_of(std::min(edge.from.y, edge.to.y) - kMostHeight);
    const double high = tile_of(std::max(edge.from.y, edge.to.y) + kMostHeight);
    // Long lines meet most tiles.
    if (edge.is_endless ||
        (right - left + 1) * (high - low + 1) >= static_cast<double>(directory.size())) {
      for (std::uint32_t tile = 0; tile < directory.size(); ++tile) add_if_near(tile, line);
      continue;
    }
    for (double y = low; y <= high; ++y) {
      for (double x = left; x <= right; ++x) {
        if (!(std::max(std::abs(x), std::abs(y)) < kMostTiles)) continue;
        const std::uint32_t tile =
            directory.Find({static_cast<std::int32_t>(y), static_cast<std::int32_t>(x)});
        if (tile != kNoTile) add_if_near(tile, line);
      }
    }
  }
  std::ranges::sort(pairs_);
}

// Whether a tile without lines is solid: as the tile left of it, if that one has no lines either.
bool WallField::IsSolidTile(const TileDirectory& directory, std::uint32_t tile) const {
  const std::uint32_t left = directory.neighbours(tile)[3];
  if (left < tile && (near_of_tile_[left] == kFluid || near_of_tile_[left] == kSolid)) {
    return near_of_tile_[left] == kSolid;
  }
  const Point origin = OriginOf(directory, tile);
  const Point middle{origin.x + kTileSize / 2.0, origin.y + kTileSize / 2.0};
  for (std::size_t solid = 0; solid < lines_.SolidCount(); ++solid) {
    if (lines_.IsSolid(solid, middle)) return true;
  }
  return false;
}

void WallField::FindTiles(const std::vector<Wall>& walls, const Rings* particle_walls,
                          double cell_size, const TileDirectory& directory) {
  lines_.Build(walls, particle_walls, cell_size);
  near_of_tile_.assign(directory.size(), kFluid);
  near_.clear();
  edges_.clear();
  ListLines(directory);
  std::size_t pair = 0;
  for (std::uint32_t tile = 0; tile < directory.size(); ++tile) {
    if (pair == pairs_.size() || pairs_[pair].first != tile) {
      if (IsSolidTile(directory, tile)) near_of_tile_[tile] = kSolid;
      continue;
    }
    near_of_tile_[tile] = static_cast<std::uint32_t>(near_.size());
    NearTile& near = near_.emplace_back();
    near.tile = tile;
    near.first = static_cast<std::uint32_t>(edges_.size());
    for (; pair < pairs_.size() && pairs_[pair].first == tile; ++pair) {
      edges_.push_back(pairs_[pair].second);
    }
    near.last = static_cast<std::uint32_t>(edges_.size());
  }
}

// The heights above each solid, of which the lowest counts.
void WallField::MeasureHeights(const TileDirectory& directory, NearTile& near) const {
  const Point origin = OriginOf(directory, near.tile);
  const auto edges = std::span(edges_).subspan(near.first, near.last - near.first);
  near.height.fill(kMostHeight);
  for (std::uint32_t solid = 0; solid < lines_.SolidCount(); ++solid) {
    std::array<float, kTileNodes> distance;
    distance.fill(kMostHeight);
    for (const std::uint32_t edge : edges) {
      if (lines_.edges()[edge].solid == solid) MeasureDistances(lines_, edge, origin, distance);
    }
    const BitRows nodes = SolidNodes(lines_, solid, origin);
    for (int node = 0; node < kTileNodes; ++node) {
      const bool is_solid = (nodes[node / kTileSize] >> (node % kTileSize) & 1) != 0;
      near.height[node] = std::min(near.height[node], is_solid ? -distance[node] : distance[node]);
    }
  }
}

void WallField::ExtendFluid(const TileDirectory& directory, const LevelSet& level_set, double reach,
                            NearTile& near) const {
  constexpr int kMostSteps = 4;  // In a corner, the way up leads to the next wall.
  const Point origin = OriginOf(directory, near.tile);
  for (int node = 0; node < kTileNodes; ++node) {
    near.fluid[node] = level_set.tiles[near.tile][node];
    const float height = near.height[node];
    if (near.fluid[node] < 0 || height >= reach || height < -kMostDepth) continue;
    Point point{origin.x + node % kTileSize, origin.y + node / kTileSize};
    bool is_above = height > 0;
    for (int step = 0; step < kMostSteps; ++step) {
      const NearestWall nearest = Nearest(near.tile, point);
      const double distance = std::abs(nearest.height);
      if (is_above && distance > reach - .01) break;
      const Point on = lines_.At(nearest.place);
      Point up = lines_.edges()[nearest.place.edge].Left();
      if (distance > 1e-3) {
        const double sign = (is_above ? 1 : -1) / distance;
        up = {(point.x - on.x) * sign, (point.y - on.y) * sign};
      }
      point = {on.x + reach * up.x, on.y + reach * up.y};
      is_above = true;
    }
    const auto above = static_cast<float>(Interpolate(directory, level_set, near.tile, point));
    if (above < 0) near.fluid[node] = above;
  }
}

void WallField::Apply(const TileDirectory& directory, double spacing, LevelSet& level_set) {
  ParallelFor(near_.size(), [&](std::size_t k) {
    MeasureHeights(directory, near_[k]);
    ExtendFluid(directory, level_set, kReach * spacing, near_[k]);
  });
  ParallelFor(directory.size(), [&](std::size_t tile) {
    const std::uint32_t of = near_of_tile_[tile];
    if (of == kFluid) return;
    BitRows& inside = level_set.inside[tile];
    auto& values = level_set.tiles[tile];
    if (of == kSolid) {
      inside = {};
      values.fill(kMostHeight);
      return;
    }
    const NearTile& near = near_[of];
    for (int j = 0; j < kTileSize; ++j) {
      inside[j] = 0;
      for (int i = 0; i < kTileSize; ++i) {
        const int node = j * kTileSize + i;
        values[node] = std::max(near.fluid[node], -near.height[node]);
        inside[j] |= std::uint32_t{values[node] < 0} << i;
      }
    }
  });
}

float WallField::HeightAt(const TilePlace& node) const {
  if (node.tile == kNoTile) return kMostHeight;
  const std::uint32_t of = near_of_tile_[node.tile];
  if (of == kFluid) return kMostHeight;
  return of == kSolid ? -kMostHeight : near_[of].height[node.j * kTileSize + node.i];
}

float WallField::FluidAt(const LevelSet& level_set, const TilePlace& node) const {
  if (node.tile == kNoTile) return level_set.void_value;
  const std::uint32_t of = near_of_tile_[node.tile];
  const int at = node.j * kTileSize + node.i;
  return of == kFluid || of == kSolid ? level_set.tiles[node.tile][at] : near_[of].fluid[at];
}

std::span<const std::uint32_t> WallField::EdgesNear(std::uint32_t tile) const {
  const std::uint32_t of = near_of_tile_[tile];
  if (of == kFluid || of == kSolid) return {};
  return std::span(edges_).subspan(near_[of].first, near_[of].last - near_[of].first);
}

NearestWall WallField::NearestOfSolid(std::uint32_t tile, std::size_t solid,
                                      const Point& point) const {
  return lines_.Nearest(EdgesNear(tile), point, solid);
}

NearestWall WallField::Nearest(std::uint32_t tile, const Point& point) const {
  return lines_.Nearest(EdgesNear(tile), point);
}

}  // namespace partiemc
