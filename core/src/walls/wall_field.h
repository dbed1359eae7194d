// Walls on the lattice: extends the fluid to its walls and cuts it there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bins/lattice.h"
#include "field/field.h"
#include "walls/wall_lines.h"

namespace partiemc {

/// The fluid near walls. A node has the height w above the nearest wall, negative in the solid, and
/// the value F of the fluid. Lengths are in cells.
///
/// Kernels see no particles beyond a wall, so F near a wall does not show whether the fluid touches
/// it. An outside node lower than the reach, `kReach` local sizes, therefore has the F of the point
/// straight above it at this height, if that point is inside. In a corner of two walls, this is the
/// point at 1.5 times the reach above both, because the field rounds corners of the fluid. Then
/// max(F, -w) replaces F on the lattice: its zeros are the outline of the fluid, cut at the walls.
///
/// A frame calls ListLines, FindTiles and Apply, in this order.
class WallField {
 public:
  /// Fluid nearer to a wall than this many local sizes touches it. For equal sizes, the local size
  /// is the spacing. The outline lies about half a size outside of the outermost particles, so a
  /// gap of this height holds no layer of particles.
  static constexpr double kReach = .5;
  /// In cells. Larger heights are not measured.
  static constexpr float kMostHeight = 4;

  /// Reads the walls (WallLines::Build). Counts the tiles near lines, and the pairs of a line and a
  /// tile near it. Cost: linear in tiles and lines, and in the product of tiles and long lines.
  void ListLines(const GivenWalls& walls, double cell_size, const TileDirectory& directory);
  std::size_t PairCount() const { return pair_count_; }
  std::size_t TileCount() const { return near_count_; }

  /// Finds the tiles near walls and the tiles in solids. Cost: near-linear in pairs, lines and
  /// tiles, and in the product of tiles and long lines.
  void FindTiles(const TileDirectory& directory);

  /// Replaces F, and the bits of inside nodes, in the tiles near walls and in solids. Parallel over
  /// tiles. Cost: linear in the nodes of these tiles, near walls times the lines near their tiles.
  void Apply(const ParticleBins& bins, const Scale& scale, LevelSet& level_set);

  const WallLines& lines() const { return lines_; }

  /// Height of a node in cells; kMostHeight in magnitude if it is not near a wall.
  float HeightAt(const TilePlace& node) const;
  /// F of the fluid at a node, extended to the walls but not cut by them.
  float FluidAt(const LevelSet& level_set, const TilePlace& node) const;

  /// The wall nearest to a point near the tile, given in cells from the origin of the world. The
  /// height is infinite if no wall is within kMostHeight. Cost: linear in the lines near the tile.
  NearestWall Nearest(std::uint32_t tile, const Point& point) const;

  /// The local size of the fluid at a point on a wall, in cells from the origin of the world, near
  /// the tile. In spacings; 0 if no kernel reaches the nodes around it, 1 for equal sizes.
  double SizeAt(const TileDirectory& directory, std::uint32_t tile, const Point& point) const;
  /// The lines near a tile.
  std::span<const std::uint32_t> EdgesNear(std::uint32_t tile) const;

  /// Calls visit(solid, nearest) for each solid with lines near a tile; `nearest` is the place
  /// nearest to the point on these lines, at any distance. Cost: linear in these lines.
  template <typename Visit>
  void ForEachSolidNear(std::uint32_t tile, const Point& point, Visit visit) const {
    const std::uint32_t of = near_of_tile_[tile];
    if (of == kFluid || of == kSolid) return;
    for (std::uint32_t k = near_[of].first; k < near_[of].last; ++k) {
      visit(std::size_t{solids_[k].solid}, lines_.Nearest(EdgesOf(solids_[k]), point));
    }
  }

 private:
  static constexpr std::uint32_t kFluid = 0xffffffff, kSolid = 0xfffffffe;  // Without lines nearby.

  struct NearTile {
    std::uint32_t tile = 0;
    std::uint32_t first = 0, last = 0;  // Its solids in `solids_`.
    std::array<float, kTileNodes> height, fluid;
  };
  // The lines of a solid near a tile.
  struct NearSolid {
    std::uint32_t solid;
    std::uint32_t first, last;      // Its lines in `edges_`.
    bool is_solid_at_mark = false;  // Whether the tile's mark (wall_field.cc) is in the solid.
  };
  // Where a line crosses a horizontal line.
  struct Crossing {
    double x;
    std::uint32_t solid;
  };

  std::span<const std::uint32_t> EdgesOf(const NearSolid& near) const {
    return std::span(edges_).subspan(near.first, near.last - near.first);
  }
  void ListShortLine(const TileDirectory& directory, std::uint32_t line);
  bool IsNear(const TileDirectory& directory, std::uint32_t tile, std::uint32_t line) const;
  void GroupBySolid(const TileDirectory& directory);
  void FindSolids(const TileDirectory& directory);
  void CollectCrossings(std::int32_t row);
  void SetTile(const TileDirectory& directory, std::uint32_t tile);
  void MeasureHeights(const TileDirectory& directory, NearTile& near) const;
  std::optional<Point> AboveCorner(std::uint32_t tile, const WallPlace& floor, double reach) const;
  void ExtendFluid(const TileDirectory& directory, const Scale& scale, const LevelSet& level_set,
                   NearTile& near) const;

  WallLines lines_;
  std::vector<std::uint32_t> near_of_tile_;  // Index in near_, kFluid or kSolid.
  std::vector<NearTile> near_;               // The first near_count_ are of this frame.
  std::size_t near_count_ = 0, pair_count_ = 0;
  // By near tile and node: the local size at nodes beside walls, in spacings; 0 where it is not
  // known. Empty for equal sizes.
  std::vector<std::array<float, kTileNodes>> sizes_;
  std::vector<NearSolid> solids_;
  std::vector<std::uint32_t> edges_;

  // Scratch of ListLines and FindTiles.
  std::vector<std::uint32_t> long_lines_, endless_;  // Lines; solids with an endless line.
  std::vector<std::size_t> long_counts_;             // By long line: tiles near it.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;  // Tile, line.
  std::vector<std::pair<std::int32_t, std::uint32_t>> by_row_;  // Row of tiles, short line.
  std::vector<Crossing> crossings_;                             // In a row, by x.
  std::vector<std::uint8_t> is_odd_;     // By solid: odd number of crossings so far.
  std::vector<std::uint8_t> is_listed_;  // By solid: has lines near the tile (SetTile).
  // Number of solids with closed loops that contain the mark of the current tile.
  std::size_t covering_ = 0;
};

}  // namespace partiemc
