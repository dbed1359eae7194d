// Stage 1: sorts the particles of a frame in space into cells.
//
// The order of the particles is a function of their positions and weights only, so that results
// have the same bits for any order of the frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "space/lattice.h"

namespace partiemc::space {

inline constexpr std::size_t kBinPadding = 8;

/// Particles of similar sizes. They are sorted into cells of 2^shift lattice cells.
struct SizeClass {
  float most = 1;  ///< The largest size of its particles, in spacings.
  int shift = 0;   ///< At most kBrickShift.
};

/// Own sizes are divided into classes of this ratio. A walk over the particles near a point has the
/// reach of the largest particle of a class, so smaller ratios find fewer particles in vain, but
/// more classes have more rows of cells.
inline constexpr float kClassRatio = 2;
/// Most classes: sizes differ at most by the square of ReconstructionParameters::kMostSizeRatio.
inline constexpr int kMostClasses = 8;

/// Particles by brick, size class, cell (layer, row, column), position and weight. Positions are in
/// cells relative to the brick, in [0, 8), rounded to 2^-17 cells, which a float holds exactly.
struct SpaceBins {
  BrickDirectory bricks;
  /// Of the particles of this frame, largest first; one for equal sizes.
  std::vector<SizeClass> classes{SizeClass{}};
  /// Per brick and class: the first particle of each cell, then the end of the last cell.
  std::vector<std::array<std::uint32_t, kBrickNodes + 1>> cells;
  /// kBinPadding values follow the last particle, so that vectors may read beyond it.
  std::vector<float> x, y, z;
  std::vector<float> weight;          ///< Empty if uniform; else padded, too.
  std::vector<float> size;            ///< Own sizes in spacings, padded; empty for equal sizes.
  std::vector<std::uint32_t> source;  ///< Index of the particle in the frame.
  /// Particles of the frame from this index on are mirror images behind walls, or copies beyond the
  /// faces of a periodic box. They count for F, but are not particles of a body.
  std::uint32_t first_image = kNoIndex;
  bool are_images_mirrored = true;  ///< False for copies: their attributes count.

  bool IsImage(std::uint32_t particle) const { return source[particle] >= first_image; }

  struct Keyed {
    std::uint64_t key;  // Cell and fractions: the whole position.
    std::uint32_t source;
  };
  /// The bounding box of the particles of a home brick, a brick with particles.
  struct Box {
    std::array<float, 3> low{8, 8, 8}, high{0, 0, 0};
  };
  std::vector<Box> boxes;                 ///< Scratch: by home brick.
  std::vector<std::uint32_t> brick_of;    ///< Scratch: by home brick.
  std::vector<std::uint32_t> home, next;  ///< Scratch: by particle, by brick.
  std::vector<std::uint64_t> keys;        ///< Scratch, by particle.
  std::vector<float> given_size;          ///< Scratch, by particle: as `size`.
  std::vector<Keyed> sorted;              ///< Scratch.
  std::vector<BrickCoordinate> homes;     ///< Scratch.

  void Clear();

  /// The particles of a brick are [FirstOf, EndOf).
  std::uint32_t FirstOf(std::size_t brick) const { return cells[brick * classes.size()].front(); }
  std::uint32_t EndOf(std::size_t brick) const {
    return cells[(brick + 1) * classes.size() - 1].back();
  }
};

/// Finds the bricks of a frame: they exist where a node is at most the kernel radius plus one cell
/// away from a particle. Sorts no particle yet, but finds their size classes. Requires: CheckFrame
/// has passed the frame as for a slice, with three components.
/// Errors with a Violation: INVALID_ARGUMENT for positions beyond 2^30 cells from the origin;
/// RESOURCE_EXHAUSTED for more than `max_tiles` bricks.
absl::Status FindBricks(const Frame& frame, const Scale& scale, const FrameLimits& limits,
                        SpaceBins& bins);

/// Sorts the particles. Requires: FindBricks.
void SortParticles(const Frame& frame, const Scale& scale, SpaceBins& bins);

/// Calls FindBricks, then SortParticles.
inline absl::Status BinParticles(const Frame& frame, const Scale& scale, const FrameLimits& limits,
                                 SpaceBins& bins) {
  absl::Status status = FindBricks(frame, scale, limits, bins);
  if (status.ok()) SortParticles(frame, scale, bins);
  return status;
}

}  // namespace partiemc::space
