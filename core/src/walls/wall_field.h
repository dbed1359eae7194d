// Walls on the lattice: extends the fluid to its walls and cuts it there.
#pragma once

#include <array>
#include <cstdint>
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
/// Near a wall, kernels see no particles beyond it, so F there does not tell whether the fluid
/// touches the wall. An outside node lower than `kReach` spacings therefore has the F of the point
/// straight above it at this height, if that point is inside. Then max(F, -w) replaces F on the
/// lattice: its zeros are the outline of the fluid, cut at the walls.
class WallField {
 public:
  /// Fluid nearer to a wall than this touches it. In spacings: the outline lies about half a
  /// spacing outside of the outermost particles, so a gap of this height holds no layer of
  /// particles.
  static constexpr double kReach = .5;

  /// Reads the walls (WallLines::Build) and finds the tiles near them. Cost: linear in tiles and
  /// lines; linear in the lines for each tile beside tiles with lines.
  void FindTiles(const std::vector<Wall>& walls, const Rings* particle_walls, double cell_size,
                 const TileDirectory& directory);
  std::size_t TileCount() const { return near_.size(); }

  /// Replaces F at the nodes of all tiles. Parallel over tiles. Cost: linear in nodes; in the tiles
  /// near walls times the lines near them.
  void Apply(const TileDirectory& directory, double spacing, LevelSet& level_set);

  const WallLines& lines() const { return lines_; }

  /// Height of a node: at least `kMostHeight` in magnitude if it is not near a wall.
  static constexpr float kMostHeight = 4;
  float HeightAt(const TilePlace& node) const;
  /// F of the fluid at a node.
  float FluidAt(const LevelSet& level_set, const TilePlace& node) const;
  /// The wall nearest to a point of a tile, given in cells from the origin of the world. Far away
  /// if no wall is within kMostHeight of it.
  NearestWall Nearest(std::uint32_t tile, const Point& point) const;
  /// The same for one solid.
  NearestWall NearestOfSolid(std::uint32_t tile, std::size_t solid, const Point& point) const;
  /// The lines near a tile.
  std::span<const std::uint32_t> EdgesNear(std::uint32_t tile) const;

 private:
  static constexpr std::uint32_t kFluid = 0xffffffff, kSolid = 0xfffffffe;  // Without lines nearby.

  struct NearTile {
    std::uint32_t tile = 0;
    std::uint32_t first = 0, last = 0;  // Its lines in `edges_`.
    std::array<float, kTileNodes> height, fluid;
  };

  void ListLines(const TileDirectory& directory);
  bool IsSolidTile(const TileDirectory& directory, std::uint32_t tile) const;
  void MeasureHeights(const TileDirectory& directory, NearTile& near) const;
  void ExtendFluid(const TileDirectory& directory, const LevelSet& level_set, double reach,
                   NearTile& near) const;

  WallLines lines_;
  std::vector<std::uint32_t> near_of_tile_;  // Index in near_, kFluid or kSolid.
  std::vector<NearTile> near_;
  std::vector<std::uint32_t> edges_;                            // By near tile.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;  // Scratch: tile, line.
};

}  // namespace partiemc
