// How much memory a frame takes.
#pragma once

#include <cstdint>

namespace partiemc {

/// What the memory of a frame follows.
struct FrameSize {
  std::uint64_t particles = 0;
  std::uint64_t tiles = 0;
  std::uint64_t segments = 0;          ///< Of the isoline, through one cell each.
  std::uint64_t grid_cells = 0;        ///< Interior cells, where the fill is `grid`; else 0.
  std::uint64_t attribute_values = 0;  ///< Of each particle, and of each vertex.
};

/// Measured over frames of all kinds, with room for vectors that grow by doubling: a compact body
/// takes 45 bytes a particle, a tile with next to nothing in it 7 kB, a segment 500 to 900 bytes,
/// with ids or without, a cell of a grid 66 bytes.
inline constexpr std::uint64_t kBytesPerParticle = 60;
inline constexpr std::uint64_t kBytesPerTile = 10'000;
inline constexpr std::uint64_t kBytesPerSegment = 1'000;
inline constexpr std::uint64_t kBytesPerGridCell = 80;

/// And where particles carry attributes: for sorting them, and of each value at a vertex.
inline constexpr std::uint64_t kBytesPerCarryingParticle = 16;
inline constexpr std::uint64_t kBytesPerCarryingTile = 4'200;
inline constexpr std::uint64_t kBytesPerValueOfSegment = 24;
inline constexpr std::uint64_t kBytesPerValueOfGridCell = 8;

/// Whatever the frame.
inline constexpr std::uint64_t kBytesAtLeast = 1 << 20;

/// No less than what a new Workspace, Result and State hold after frames of this size, and not much
/// more (tests/core/allocation_test.cc: up to 2.2 times as much, where it is more than a few MB).
inline std::uint64_t WorkspaceBytes(const FrameSize& size) {
  std::uint64_t bytes = kBytesAtLeast + kBytesPerParticle * size.particles +
                        kBytesPerTile * size.tiles + kBytesPerSegment * size.segments +
                        kBytesPerGridCell * size.grid_cells;
  if (size.attribute_values > 0) {
    bytes += kBytesPerCarryingParticle * size.particles + kBytesPerCarryingTile * size.tiles +
             size.attribute_values * (kBytesPerValueOfSegment * size.segments +
                                      kBytesPerValueOfGridCell * size.grid_cells);
  }
  return bytes;
}

}  // namespace partiemc
