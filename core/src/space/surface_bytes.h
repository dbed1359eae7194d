// An upper bound of the memory of a surface.
#pragma once

#include <algorithm>
#include <cstdint>

namespace partiemc::space {

/// The counts that determine the memory of a surface.
struct SurfaceSize {
  std::uint64_t particles = 0;
  std::uint64_t bricks = 0;
  std::uint64_t size_classes = 0;      ///< Of own sizes; 0 for equal sizes.
  std::uint64_t edges = 0;             ///< Crossed edges.
  std::uint64_t loops = 0;             ///< Loops of cells, if vertices leave their anchors; else 0.
  bool has_windows = false;            ///< True for `kVirtualPlane`.
  std::uint64_t bodies = 0;            ///< Bodies, and lone particles that may become ellipsoids.
  std::uint64_t lone = 0;              ///< Lone particles that may become ellipsoids.
  bool has_large_lone = false;         ///< Some may be larger than kSmallDropVolume.
  std::uint64_t attribute_values = 0;  ///< Components of all attributes.
  bool has_state = false;              ///< The frame belongs to a stream.
  bool is_simplified = false;
  std::uint64_t wall_axes = 0;  ///< Axes that have walls.
  std::uint64_t box_axes = 0;   ///< Axes along which bodies are cut at a periodic box.
  /// Bytes of the scratch of a periodic box (periodic/lift.h) and of walls (walls/wall_images.h).
  std::uint64_t lift_bytes = 0;
  std::uint64_t samples = 0;  ///< Particles that a state may store; 0 without ids.
};

/// Bytes per item of SurfaceSize, with a margin for vectors that grow by doubling.
/// LoopWindows::kMostNear bounds the windows.
inline constexpr std::uint64_t kBytesPerParticle = 60;
inline constexpr std::uint64_t kBytesPerBrick = 6'000;
inline constexpr std::uint64_t kBytesPerEdge = 300;
inline constexpr std::uint64_t kBytesPerLoop = 450;
inline constexpr std::uint64_t kBytesPerWindow = 870;

/// Further bytes with own sizes. Windows in local sizes reach more loops.
inline constexpr std::uint64_t kBytesPerSizedParticle = 16;
inline constexpr std::uint64_t kBytesPerCellsOfClass = 2'060;  ///< Per brick and further class.
inline constexpr std::uint64_t kBytesPerSizedVertex = 4;
inline constexpr std::uint64_t kBytesPerSizedWindow = 500;

/// Bytes of identities: runs of nodes, one or two for two crossed edges along x; histories of two
/// frames and their relations.
inline constexpr std::uint64_t kBytesPerTrackedEdge = 120;
inline constexpr std::uint64_t kBytesPerTrackedBody = 500;
inline constexpr std::uint64_t kBytesPerTrackedParticle = 4;
inline constexpr std::uint64_t kBytesPerSample = 200;

/// Bytes of one value of an attribute at a point. An ellipsoid has up to 42 points.
inline constexpr std::uint64_t kBytesPerValue = 8;
inline constexpr std::uint64_t kMostPointsOfDrop = 42;
/// Vertices of the smallest body, which has one node: six on edges, eight in cells. An ellipsoid
/// replaces at least so many.
inline constexpr std::uint64_t kLeastPointsOfBody = 14;
/// Ellipsoids of at most kSmallDropVolume, in cubed spacings, have kPointsOfSmallDrop points.
inline constexpr std::uint64_t kPointsOfSmallDrop = 12;
inline constexpr double kSmallDropVolume = 1.7;

/// If more drops reach a brick, none of them becomes an ellipsoid. This limits the compared pairs
/// and the ellipsoids.
inline constexpr std::uint32_t kMostDropsOfBrick = 256;

/// Bytes of the drop of a lone particle, and of a point of its ellipsoid. A small drop reaches at
/// most 8 bricks, a large one 64.
inline constexpr std::uint64_t kBytesPerSmallDrop = 640, kBytesPerLargeDrop = 1600;
inline constexpr std::uint64_t kBytesPerLonePoint = 300;

/// Bytes of the simplification of a point: about 240 of meshoptimizer, or the check for contacts.
inline constexpr std::uint64_t kBytesPerSimplifiedPoint = 400;

/// Bytes of the cut at walls, per point: for the first axis with walls, and for each further axis.
/// Lone particles at edges of walls require the most.
inline constexpr std::uint64_t kBytesPerCutPoint = 1600, kBytesPerCutAxis = 900;

/// Bytes of the cut at the faces of a periodic box, per point of the surface before the cut: copies
/// of all points and triangles, and the cuts along each axis. The cuts need little memory: before
/// the cut, a body that percolates continues far beyond the faces, so few of its points are near a
/// cut. Wrapped spray has more points near a cut. The bound holds for it, too
/// (tests/core/space_memory_test.cc).
inline constexpr std::uint64_t kBytesPerBoxPoint = 450, kBytesPerBoxAxis = 50;

/// Bytes added for every frame.
inline constexpr std::uint64_t kBytesAtLeast = 1 << 20;

/// Upper bound of the bytes of a new SurfaceWorkspace, Surface and SurfaceState after a frame of
/// this size (tests/core/space_memory_test.cc).
inline std::uint64_t SurfaceBytes(const SurfaceSize& size) {
  const std::uint64_t per_loop = kBytesPerLoop + (size.has_windows ? kBytesPerWindow : 0);
  std::uint64_t bytes = kBytesAtLeast + kBytesPerParticle * size.particles +
                        kBytesPerBrick * size.bricks + kBytesPerEdge * size.edges +
                        per_loop * size.loops;
  bytes += size.lift_bytes;
  if (size.size_classes > 0) {
    bytes += kBytesPerSizedParticle * size.particles +
             kBytesPerCellsOfClass * (size.size_classes - 1) * size.bricks;
    if (size.has_windows) {
      bytes += kBytesPerSizedVertex * (size.edges + size.loops) + kBytesPerSizedWindow * size.loops;
    }
  }
  if (size.has_windows) {
    const std::uint64_t most = std::min(size.lone, kMostDropsOfBrick * size.bricks);
    bytes += (size.has_large_lone ? kBytesPerLargeDrop : kBytesPerSmallDrop) * size.lone;
    bytes +=
        kBytesPerLonePoint * most * (size.has_large_lone ? kMostPointsOfDrop : kPointsOfSmallDrop);
  }
  const std::uint64_t replaced = kLeastPointsOfBody * (size.bodies - size.lone);
  const std::uint64_t drop_points =
      size.has_windows ? kMostPointsOfDrop * size.bodies - replaced : 0;
  const std::uint64_t points = size.edges + size.loops + drop_points;
  bytes += kBytesPerValue * size.attribute_values * points;
  if (size.is_simplified) bytes += kBytesPerSimplifiedPoint * points;
  if (size.wall_axes > 0) {
    bytes += (kBytesPerCutPoint + kBytesPerCutAxis * (size.wall_axes - 1)) * points;
  }
  if (size.box_axes > 0) {
    bytes += (kBytesPerBoxPoint + kBytesPerBoxAxis * size.box_axes) * points;
  }
  if (size.has_state) {
    bytes += kBytesPerTrackedEdge * size.edges + kBytesPerTrackedBody * size.bodies +
             kBytesPerTrackedParticle * size.particles + kBytesPerSample * size.samples;
  }
  return bytes;
}

}  // namespace partiemc::space
