// Estimates the memory of a surface.
#pragma once

#include <cstdint>

namespace partiemc::space {

/// The counts that determine the memory of a surface.
struct SurfaceSize {
  std::uint64_t particles = 0;
  std::uint64_t bricks = 0;
  std::uint64_t edges = 0;   ///< Crossed edges.
  std::uint64_t loops = 0;   ///< Loops of cells, if vertices leave their anchors; else 0.
  bool has_windows = false;  ///< Of `kVirtualPlane`.
};

/// Bytes per item, with a margin for vectors that grow by doubling. LoopWindows::kMostNear
/// bounds the windows.
inline constexpr std::uint64_t kBytesPerParticle = 60;
inline constexpr std::uint64_t kBytesPerBrick = 6'000;
inline constexpr std::uint64_t kBytesPerEdge = 300;
inline constexpr std::uint64_t kBytesPerLoop = 450;
inline constexpr std::uint64_t kBytesPerWindow = 1'100;

/// For any frame.
inline constexpr std::uint64_t kBytesAtLeast = 1 << 20;

/// Upper bound of the memory of a new SurfaceWorkspace and Surface after frames of this size
/// (tests/core/allocation_test.cc).
inline std::uint64_t SurfaceBytes(const SurfaceSize& size) {
  const std::uint64_t per_loop = kBytesPerLoop + (size.has_windows ? kBytesPerWindow : 0);
  return kBytesAtLeast + kBytesPerParticle * size.particles + kBytesPerBrick * size.bricks +
         kBytesPerEdge * size.edges + per_loop * size.loops;
}

}  // namespace partiemc::space
