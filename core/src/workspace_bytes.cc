#include "workspace_bytes.h"

namespace partiemc {
namespace {

// Measured over frames of all kinds, with room for vectors that grow by doubling: a compact body
// takes 45 bytes a particle, a tile with next to nothing in it 7 kB, a segment 500 to 900 bytes,
// with ids or without, a cell of a grid 66 bytes.
constexpr std::uint64_t kBytesPerParticle = 60;
constexpr std::uint64_t kBytesPerTile = 10'000;
constexpr std::uint64_t kBytesPerSegment = 1'000;
constexpr std::uint64_t kBytesPerGridCell = 80;

// Whatever the frame.
constexpr std::uint64_t kBytesAtLeast = 1 << 20;

}  // namespace

std::uint64_t WorkspaceBytes(const FrameSize& size) {
  return kBytesAtLeast + kBytesPerParticle * size.particles + kBytesPerTile * size.tiles +
         kBytesPerSegment * size.segments + kBytesPerGridCell * size.grid_cells;
}

}  // namespace partiemc
