#include "walls/wall_field.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "base/cancellation.h"
#include "base/parallel.h"
#include "base/point.h"
#include "walls/tile_point.h"

namespace partiemc {
namespace {

// In cells. Fluid farther from a wall than this never touches it. Less than kMostHeight.
constexpr double kMostReach = 3.5;
// In corners this factor lengthens the reach, because the field rounds a corner of the fluid.
constexpr double kCornerReach = 1.5;
// The point above a corner is at most this far from the wall below the node, in cells, because
// walls far from the tile are not known.
constexpr double kFarthestPoint = 12;
// The nodes around a point on a wall are at most this far from the wall, in cells.
constexpr float kBeside = 1.5F;
// Nodes deeper in the solid than this, in cells, need no value of the fluid: no lattice edge joins
// them to the outside of a wall.
constexpr float kMostDepth = 1.5F;
// Limit of the coordinates of tiles.
constexpr double kMostTiles = 1 << 30;
// A line whose bounds have more tiles than this is long.
constexpr double kShortTiles = 64;
// Half the diagonal of a tile.
constexpr double kTileRadius = kTileSize * .7072;
// The mark of a tile lies this far, in cells, left of and below its first node. From the mark,
// paths between the columns and rows of nodes lead to every node of the tile. The number is no
// simple fraction, so corners of walls rarely lie on paths. A corner on a path may put a row of
// nodes on the wrong side.
constexpr double kMark = .3819660112501051;
// FindSolids checks for cancellation at each row, and at each multiple of this number of tiles.
constexpr std::uint32_t kTilesPerCheck = 1 << 10;

// The height of the marks of a row of tiles.
double MarkOf(std::int32_t row) { return static_cast<double>(row) * kTileSize - kMark; }

Point MiddleOf(const TileDirectory& directory, std::uint32_t tile) {
  const Point origin = OriginOf(directory, tile);
  return {origin.x + kTileSize / 2.0, origin.y + kTileSize / 2.0};
}

// The bounds of the tiles, with a margin.
WallLines::Window WindowOf(const TileDirectory& directory) {
  constexpr double kMargin = 2 * kTileSize;
  WallLines::Window window{{0, 0}, {0, 0}};
  for (std::uint32_t tile = 0; tile < directory.size(); ++tile) {
    const Point at = OriginOf(directory, tile);
    if (tile == 0) window = {at, at};
    window.low = {std::min(window.low.x, at.x), std::min(window.low.y, at.y)};
    window.high = {std::max(window.high.x, at.x), std::max(window.high.y, at.y)};
  }
  window.low = {window.low.x - kMargin, window.low.y - kMargin};
  window.high = {window.high.x + kMargin, window.high.y + kMargin};
  return window;
}

// The tiles around a line.
struct TileBounds {
  double left, right, low, high;

  explicit TileBounds(const WallEdge& edge) {
    const auto tile_of = [](double at) { return std::floor(at / kTileSize); };
    left = tile_of(std::min(edge.from.x, edge.to.x) - WallField::kMostHeight);
    right = tile_of(std::max(edge.from.x, edge.to.x) + WallField::kMostHeight);
    low = tile_of(std::min(edge.from.y, edge.to.y) - WallField::kMostHeight);
    high = tile_of(std::max(edge.from.y, edge.to.y) + WallField::kMostHeight);
  }
  bool IsShort() const { return (right - left + 1) * (high - low + 1) <= kShortTiles; }
  bool HasRows() const { return low > -kMostTiles && high < kMostTiles; }
  bool HasColumns() const { return left > -kMostTiles && right < kMostTiles; }
};

// Whether the line crosses a horizontal (vertical) line, and where.
bool SpansRow(const WallEdge& edge, double y) { return (edge.from.y <= y) != (edge.to.y <= y); }
bool SpansColumn(const WallEdge& edge, double x) { return (edge.from.x <= x) != (edge.to.x <= x); }
double CrossesRowAt(const WallEdge& edge, double y) {
  return edge.from.x + (y - edge.from.y) / (edge.to.y - edge.from.y) * (edge.to.x - edge.from.x);
}
double CrossesColumnAt(const WallEdge& edge, double x) {
  return edge.from.y + (x - edge.from.x) / (edge.to.x - edge.from.x) * (edge.to.y - edge.from.y);
}

// F at a point of a tile and its neighbours, by bilinear interpolation.
double Interpolate(const TileDirectory& directory, const LevelSet& level_set, std::uint32_t tile,
                   const Point& point) {
  const Surrounded of(directory, tile, point);
  const auto at = [&](int di, int dj) -> double {
    const TilePlace node = Normalise(directory, tile, of.i + di, of.j + dj);
    return node.tile == kNoTile ? level_set.void_value
                                : level_set.tiles[node.tile][node.j * kTileSize + node.i];
  };
  return (1 - of.v) * ((1 - of.u) * at(0, 0) + of.u * at(1, 0)) +
         of.v * ((1 - of.u) * at(0, 1) + of.u * at(1, 1));
}

// Bits i >= `begin`.
std::uint32_t BitsFrom(double begin) {
  if (!(begin < kTileSize)) return 0;
  return begin > 0 ? ~std::uint32_t{0} << static_cast<int>(begin) : ~std::uint32_t{0};
}

// The nodes of a tile in a solid, by crossings of paths from the tile's mark.
BitRows SolidNodes(const WallLines& lines, std::span<const std::uint32_t> edges, std::size_t solid,
                   bool is_solid_at_mark, const Point& origin) {
  BitRows rows{};
  if (lines.IsEndless(solid)) {
    for (int node = 0; node < kTileNodes; ++node) {
      const Point at{origin.x + node % kTileSize, origin.y + node / kTileSize};
      rows[node / kTileSize] |= std::uint32_t{lines.IsBehindEndless(solid, at)} << node % kTileSize;
    }
    return rows;
  }
  if (is_solid_at_mark) rows.fill(~std::uint32_t{0});
  const Point mark{origin.x - kMark, origin.y - kMark};
  for (const std::uint32_t line : edges) {
    const WallEdge& edge = lines.edges()[line];
    if (SpansColumn(edge, mark.x)) {
      const double y = CrossesColumnAt(edge, mark.x);
      const double first = std::max(0.0, std::ceil(y - origin.y));
      for (int j = y > mark.y && first < kTileSize ? static_cast<int>(first) : kTileSize;
           j < kTileSize; ++j) {
        rows[j] = ~rows[j];
      }
    }
    const double low = std::max(std::min(edge.from.y, edge.to.y) - origin.y, 0.0);
    const double high = std::max(edge.from.y, edge.to.y) - origin.y;
    for (int j = low < kTileSize ? static_cast<int>(std::ceil(low)) : kTileSize;
         j < kTileSize && j <= high; ++j) {
      if (!SpansRow(edge, origin.y + j)) continue;
      const double x = CrossesRowAt(edge, origin.y + j);
      if (x > mark.x) rows[j] ^= BitsFrom(std::ceil(x - origin.x));
    }
  }
  return rows;
}

// Lowers `distance` of each node of a tile to the node's distance from a line, if that is smaller.
// Skips nodes that are farther than WallField::kMostHeight from the line's bounding box.
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

bool WallField::IsNear(const TileDirectory& directory, std::uint32_t tile,
                       std::uint32_t line) const {
  return std::abs(lines_.NearestOn(line, MiddleOf(directory, tile)).height) <=
         kTileRadius + kMostHeight;
}

// Pairs a short line with the tiles near it, and lists the rows of tiles whose marks it crosses.
void WallField::ListShortLine(const TileDirectory& directory, std::uint32_t line) {
  const WallEdge& edge = lines_.edges()[line];
  const TileBounds bounds(edge);
  if (!bounds.HasRows()) return;
  // A line far to the left still decides what is solid.
  const auto left = bounds.HasColumns() ? static_cast<std::int32_t>(bounds.left) : 0;
  const auto right = bounds.HasColumns() ? static_cast<std::int32_t>(bounds.right) : -1;
  const auto high = static_cast<std::int32_t>(bounds.high);
  for (auto y = static_cast<std::int32_t>(bounds.low); y <= high; ++y) {
    if (SpansRow(edge, MarkOf(y))) by_row_.emplace_back(y, line);
    for (std::int32_t x = left; x <= right; ++x) {
      const std::uint32_t tile = directory.Find({y, x});
      if (tile == kNoTile || !IsNear(directory, tile, line)) continue;
      near_of_tile_[tile] = 0;
      pairs_.emplace_back(tile, line);
    }
  }
}

void WallField::ListLines(const GivenWalls& walls, double cell_size,
                          const TileDirectory& directory) {
  lines_.Build(walls, cell_size, WindowOf(directory));
  near_of_tile_.assign(directory.size(), kFluid);
  pairs_.clear();
  by_row_.clear();
  long_lines_.clear();
  endless_.clear();
  for (std::uint32_t line = 0; line < lines_.edges().size(); ++line) {
    const WallEdge& edge = lines_.edges()[line];
    if (edge.is_endless) endless_.push_back(edge.solid);
    if (edge.is_endless || !TileBounds(edge).IsShort()) {
      long_lines_.push_back(line);
    } else {
      ListShortLine(directory, line);
    }
  }
  ThrowIfCancelled();
  std::ranges::sort(by_row_);
  long_counts_.resize(long_lines_.size());
  ParallelFor(long_lines_.size(), [&](std::size_t k) {
    std::size_t count = 0;
    for (std::uint32_t tile = 0; tile < directory.size(); ++tile) {
      if (!IsNear(directory, tile, long_lines_[k])) continue;
      // Several lines may mark a tile.
      std::atomic_ref(near_of_tile_[tile]).store(0, std::memory_order_relaxed);
      ++count;
    }
    long_counts_[k] = count;
  });
  pair_count_ = pairs_.size();
  for (const std::size_t count : long_counts_) pair_count_ += count;
  near_count_ = directory.size() -
                static_cast<std::size_t>(std::ranges::count(near_of_tile_, std::uint32_t{kFluid}));
}

void WallField::FindTiles(const TileDirectory& directory) {
  std::size_t at = pairs_.size();
  pairs_.resize(pair_count_);
  for (std::size_t& count : long_counts_) at += std::exchange(count, at);
  ParallelFor(long_lines_.size(), [&](std::size_t k) {
    std::size_t to = long_counts_[k];
    for (std::uint32_t tile = 0; tile < directory.size(); ++tile) {
      if (IsNear(directory, tile, long_lines_[k])) pairs_[to++] = {tile, long_lines_[k]};
    }
  });
  ThrowIfCancelled();
  std::ranges::sort(pairs_);
  GroupBySolid(directory);
  FindSolids(directory);
}

// Makes the near tiles of the sorted pairs. The lines of a solid are consecutive.
void WallField::GroupBySolid(const TileDirectory& directory) {
  near_of_tile_.assign(directory.size(), kFluid);
  solids_.clear();
  edges_.clear();
  if (near_.size() < near_count_) {
    near_.reserve(near_count_);
    near_.resize(near_count_);
  }
  std::size_t near = 0;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const auto [tile, line] = pairs_[k];
    const bool is_new_tile = k == 0 || tile != pairs_[k - 1].first;
    if (is_new_tile) {
      near_of_tile_[tile] = static_cast<std::uint32_t>(near);
      near_[near].tile = tile;
      near_[near].first = static_cast<std::uint32_t>(solids_.size());
      ++near;
    }
    const std::uint32_t solid = lines_.edges()[line].solid;
    if (is_new_tile || solid != solids_.back().solid) {
      const auto first = static_cast<std::uint32_t>(edges_.size());
      solids_.push_back({.solid = solid, .first = first, .last = first});
    }
    edges_.push_back(line);
    solids_.back().last = static_cast<std::uint32_t>(edges_.size());
    near_[near - 1].last = static_cast<std::uint32_t>(solids_.size());
  }
}

// Sets `crossings_` to the crossings of closed loops with the line through the marks of a row of
// tiles.
void WallField::CollectCrossings(std::int32_t row) {
  const double y = MarkOf(row);
  crossings_.clear();
  const auto add = [&](std::uint32_t line) {
    const WallEdge& edge = lines_.edges()[line];
    crossings_.push_back({CrossesRowAt(edge, y), edge.solid});
  };
  auto of_row = std::ranges::lower_bound(by_row_, std::pair(row, std::uint32_t{0}));
  for (; of_row != by_row_.end() && of_row->first == row; ++of_row) add(of_row->second);
  for (const std::uint32_t line : long_lines_) {
    const WallEdge& edge = lines_.edges()[line];
    if (!edge.is_endless && SpansRow(edge, y)) add(line);
  }
  std::ranges::sort(crossings_, {}, &Crossing::x);
}

// Finds for each tile the solids that contain its mark, a point beside the tile (kMark). Along each
// row of tiles, counts the crossings of closed loops left of a mark. SetTile adds the solids with
// an endless line, and stores the result.
void WallField::FindSolids(const TileDirectory& directory) {
  std::uint32_t tile = 0;
  is_listed_.assign(lines_.SolidCount(), 0);
  while (tile < directory.size()) {
    ThrowIfCancelled();
    const std::int32_t row = directory[tile].y;
    CollectCrossings(row);
    is_odd_.assign(lines_.SolidCount(), 0);
    covering_ = 0;
    for (std::size_t solid = 0; solid < lines_.SolidCount(); ++solid) {
      covering_ += !lines_.IsEndless(solid) && !lines_.IsSolidInside(solid);
    }
    std::size_t crossing = 0;
    for (; tile < directory.size() && directory[tile].y == row; ++tile) {
      if (tile % kTilesPerCheck == 0) ThrowIfCancelled();
      const double x = OriginOf(directory, tile).x - kMark;
      for (; crossing < crossings_.size() && crossings_[crossing].x <= x; ++crossing) {
        const std::uint32_t solid = crossings_[crossing].solid;
        is_odd_[solid] ^= 1;
        (is_odd_[solid] != 0) == lines_.IsSolidInside(solid) ? ++covering_ : --covering_;
      }
      SetTile(directory, tile);
    }
  }
}

// Sets for each solid near the tile whether it contains the tile's mark. If any other solid
// contains the mark, the whole tile is solid.
void WallField::SetTile(const TileDirectory& directory, std::uint32_t tile) {
  const Point origin = OriginOf(directory, tile);
  const Point mark{origin.x - kMark, origin.y - kMark};
  std::size_t covering = covering_;
  const std::uint32_t near = near_of_tile_[tile];
  const auto listed = near == kFluid ? std::span<NearSolid>()
                                     : std::span(solids_).subspan(
                                           near_[near].first, near_[near].last - near_[near].first);
  for (NearSolid& of : listed) {
    is_listed_[of.solid] = 1;
    if (lines_.IsEndless(of.solid)) continue;
    of.is_solid_at_mark = (is_odd_[of.solid] != 0) == lines_.IsSolidInside(of.solid);
    covering -= of.is_solid_at_mark;
  }
  for (const std::uint32_t solid : endless_) {
    if (covering > 0) break;
    covering += is_listed_[solid] == 0 && lines_.IsBehindEndless(solid, mark);
  }
  for (const NearSolid& of : listed) is_listed_[of.solid] = 0;
  if (covering > 0) near_of_tile_[tile] = kSolid;
}

// Sets the height of each node: the lowest of its heights above the solids near the tile.
void WallField::MeasureHeights(const TileDirectory& directory, NearTile& near) const {
  const Point origin = OriginOf(directory, near.tile);
  near.height.fill(kMostHeight);
  for (std::uint32_t k = near.first; k < near.last; ++k) {
    const NearSolid& of = solids_[k];
    std::array<float, kTileNodes> distance;
    distance.fill(kMostHeight);
    for (const std::uint32_t edge : EdgesOf(of)) MeasureDistances(lines_, edge, origin, distance);
    const BitRows nodes = SolidNodes(lines_, EdgesOf(of), of.solid, of.is_solid_at_mark, origin);
    for (int node = 0; node < kTileNodes; ++node) {
      const bool is_solid = (nodes[node / kTileSize] >> (node % kTileSize) & 1) != 0;
      near.height[node] = std::min(near.height[node], is_solid ? -distance[node] : distance[node]);
    }
  }
}

double WallField::SizeAt(const TileDirectory& directory, std::uint32_t tile,
                         const Point& point) const {
  if (sizes_.empty()) return 1;
  const Surrounded of(directory, tile, point);
  double sum = 0, weight = 0;
  for (const auto& [di, dj] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
    const TilePlace node = Normalise(directory, tile, of.i + di, of.j + dj);
    if (node.tile == kNoTile || near_of_tile_[node.tile] >= near_count_) continue;
    const float size = sizes_[near_of_tile_[node.tile]][node.j * kTileSize + node.i];
    if (!(size > 0)) continue;
    const double share = (di != 0 ? of.u : 1 - of.u) * (dj != 0 ? of.v : 1 - of.v);
    sum += share * size;
    weight += share;
  }
  return weight > 0 ? sum / weight : 0;
}

// The point at the height `reach` above both walls of a corner, if a node is nearer to both.
// `floor`: the place on the walls that is nearest to the node.
std::optional<Point> WallField::AboveCorner(std::uint32_t tile, const WallPlace& floor,
                                            double reach) const {
  const Point foot = lines_.At(floor), left = lines_.edges()[floor.edge].Left();
  const auto is_below = [&](const NearestWall& wall) { return wall.height < .99 * reach; };
  const NearestWall side = Nearest(tile, Plus(foot, Times(left, reach)));
  if (!is_below(side)) return std::nullopt;
  const std::optional<Point> above = lines_.AboveCorner(floor.edge, side.place.edge, reach);
  if (!above || Length(Minus(*above, foot)) > kFarthestPoint || is_below(Nearest(tile, *above))) {
    return std::nullopt;
  }
  return above;
}

void WallField::ExtendFluid(const TileDirectory& directory, const Scale& scale,
                            const LevelSet& level_set, NearTile& near) const {
  const double most_reach = kReach * scale.spacing * scale.sizes.largest;
  const Point origin = OriginOf(directory, near.tile);
  for (int node = 0; node < kTileNodes; ++node) {
    near.fluid[node] = level_set.tiles[near.tile][node];
    const float height = near.height[node];
    if (near.fluid[node] < 0 || height >= most_reach || height < -kMostDepth) continue;
    const Point at{origin.x + node % kTileSize, origin.y + node / kTileSize};
    const NearestWall nearest = Nearest(near.tile, at);
    const Point foot = lines_.At(nearest.place);
    const double local_reach = kReach * scale.spacing * SizeAt(directory, near.tile, foot);
    const double reach = std::min(local_reach, kMostReach);
    if (height >= reach) continue;
    std::optional<Point> point =
        AboveCorner(near.tile, nearest.place, std::min(kCornerReach * reach, kMostReach));
    if (!point) {
      const double distance = std::abs(nearest.height);
      const Point up = distance > 1e-3 ? Times(Minus(at, foot), (height > 0 ? 1 : -1) / distance)
                                       : lines_.edges()[nearest.place.edge].Left();
      point = Plus(foot, Times(up, reach));
    }
    const auto above = static_cast<float>(Interpolate(directory, level_set, near.tile, *point));
    if (above < 0) near.fluid[node] = above;
  }
}

void WallField::Apply(const ParticleBins& bins, const Scale& scale, LevelSet& level_set) {
  const TileDirectory& directory = bins.tiles;
  if (scale.has_own_sizes) sizes_.reserve(near_count_);  // Doubling would take more memory.
  sizes_.resize(scale.has_own_sizes ? near_count_ : 0);
  ParallelFor(near_count_, [&](std::size_t k) {
    if (near_of_tile_[near_[k].tile] == kSolid) return;
    MeasureHeights(directory, near_[k]);
    if (!scale.has_own_sizes) return;
    BitRows beside{};
    for (int node = 0; node < kTileNodes; ++node) {
      if (std::abs(near_[k].height[node]) > kBeside) continue;
      beside[node / kTileSize] |= std::uint32_t{1} << node % kTileSize;
    }
    sizes_[k].fill(0);
    FindLocalSizes(bins, scale, near_[k].tile, beside, sizes_[k]);
  });
  ParallelFor(near_count_, [&](std::size_t k) {
    if (near_of_tile_[near_[k].tile] != kSolid) ExtendFluid(directory, scale, level_set, near_[k]);
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
  const std::uint32_t first = solids_[near_[of].first].first;
  return std::span(edges_).subspan(first, solids_[near_[of].last - 1].last - first);
}

NearestWall WallField::Nearest(std::uint32_t tile, const Point& point) const {
  const NearestWall nearest = lines_.Nearest(EdgesNear(tile), point);
  return std::abs(nearest.height) <= kMostHeight ? nearest : NearestWall{};
}

}  // namespace partiemc
