// Estimates the memory of a frame.
#pragma once

#include <cstdint>

namespace partiemc {

/// The counts that determine the memory of a frame.
struct FrameSize {
  std::uint64_t particles = 0;
  std::uint64_t tiles = 0;
  std::uint64_t segments = 0;          ///< Of the outline: one per active cell, two per saddle.
  std::uint64_t cut_segments = 0;      ///< `segments` if a periodic box can cut rings, else 0.
  std::uint64_t grid_cells = 0;        ///< Interior cells if the fill is `grid`, else 0.
  std::uint64_t block_cells = 0;       ///< Interior cells if the mesh has blocks, else 0.
  std::uint64_t block_tiles = 0;       ///< Tiles with such cells.
  std::uint64_t attribute_values = 0;  ///< Values of attributes per particle or vertex.
  std::uint64_t phases = 0;            ///< Phases that divide the outline.
  std::uint64_t interface_points = 0;  ///< Points of the interfaces between phases.
  std::uint64_t wall_tiles = 0;        ///< Tiles near walls.
  std::uint64_t wall_pairs = 0;        ///< Pairs of such a tile and a line near it.
  std::uint64_t wall_lines = 0;        ///< Lines of walls.
};

/// Bytes per item: measured over frames of all kinds, plus a margin because vectors grow by
/// doubling. Measured: 45 bytes per particle of a compact body, 7 kB per nearly empty tile, 500 to
/// 900 bytes per segment (with or without ids), 66 bytes per grid cell.
inline constexpr std::uint64_t kBytesPerParticle = 60;
inline constexpr std::uint64_t kBytesPerTile = 10'000;
inline constexpr std::uint64_t kBytesPerSegment = 1'000;
inline constexpr std::uint64_t kBytesPerCutSegment = 250;
inline constexpr std::uint64_t kBytesPerGridCell = 80;

/// Additional bytes if the frame has attributes: to sort the particles, and per value at a vertex.
inline constexpr std::uint64_t kBytesPerCarryingParticle = 16;
inline constexpr std::uint64_t kBytesPerCarryingTile = 4'200;
inline constexpr std::uint64_t kBytesPerValueOfSegment = 24;
inline constexpr std::uint64_t kBytesPerValueOfGridCell = 8;

/// A block of one cell takes the bytes of a grid cell, of a node, and of the node's values.
inline constexpr std::uint64_t kBytesPerBlockCell = kBytesPerGridCell + 24;
inline constexpr std::uint64_t kBytesPerValueOfBlockCell = 10;

/// If the mesh has blocks: bytes for each tile with interior cells. They hold sums over the
/// particles in each of the tile's 64 windows (mesh/blocks.cc): moments, and values of attributes.
/// A vector of two components also has a sum of its length, so each value counts one and a half
/// times.
inline constexpr std::uint64_t kBytesPerBlockTile = 2'048;
inline constexpr std::uint64_t kBytesPerValueOfBlockTile = 768;

/// If phases divide the outline: bytes for each particle and tile, for each tile and phase, and for
/// each point of an interface.
inline constexpr std::uint64_t kBytesPerPhaseParticle = 26;
inline constexpr std::uint64_t kBytesPerPhaseTile = 10'000;
inline constexpr std::uint64_t kBytesPerTileOfPhase = 900;
inline constexpr std::uint64_t kBytesPerInterfacePoint = 500;

/// Bytes for each tile near walls, for each line near such a tile, and for each line.
inline constexpr std::uint64_t kBytesPerWallTile = 13'000;
inline constexpr std::uint64_t kBytesPerWallPair = 60;
inline constexpr std::uint64_t kBytesPerWallLine = 300;

/// Bytes that any frame takes.
inline constexpr std::uint64_t kBytesAtLeast = 1 << 20;

/// Upper bound of the memory of a new Workspace, Result and State after frames of this size. Above
/// a few MB, it is at most 2.5 times the actual memory in tests/core/memory_test.cc, or 4 times if
/// attributes are smooth, because their meshes are small. Phases with long interfaces: up to 6
/// times.
inline std::uint64_t WorkspaceBytes(const FrameSize& size) {
  std::uint64_t bytes = kBytesAtLeast + kBytesPerParticle * size.particles +
                        kBytesPerTile * size.tiles + kBytesPerSegment * size.segments +
                        kBytesPerCutSegment * size.cut_segments +
                        kBytesPerWallTile * size.wall_tiles + kBytesPerWallPair * size.wall_pairs +
                        kBytesPerWallLine * size.wall_lines + kBytesPerGridCell * size.grid_cells +
                        kBytesPerBlockCell * size.block_cells;
  if (size.phases > 0) {
    bytes += kBytesPerPhaseParticle * size.particles + kBytesPerPhaseTile * size.tiles +
             kBytesPerTileOfPhase * size.tiles * (size.phases + 1) +
             kBytesPerInterfacePoint * size.interface_points;
  }
  if (size.attribute_values > 0) {
    bytes += kBytesPerCarryingParticle * size.particles + kBytesPerCarryingTile * size.tiles +
             size.attribute_values * (kBytesPerValueOfSegment * size.segments +
                                      kBytesPerValueOfGridCell * size.grid_cells +
                                      kBytesPerValueOfBlockCell * size.block_cells);
    bytes +=
        size.block_tiles * (kBytesPerBlockTile + kBytesPerValueOfBlockTile * size.attribute_values);
  }
  return bytes;
}

}  // namespace partiemc
