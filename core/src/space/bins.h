// Stage 1: sorts the particles of a frame in space into cells.
//
// The order of the particles in the bins follows from their positions, volumes and attributes. So
// results have the same bits for any order of the particles in the frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "frame/scale.h"
#include "partiemc/frame.h"
#include "space/lattice.h"

namespace partiemc::space {

inline constexpr std::size_t kBinPadding = 8;

/// Particles of similar sizes. They are sorted into cells with a side of 2^shift lattice cells.
struct SizeClass {
  float most = 1;  ///< The largest size of its particles, in spacings.
  int shift = 0;   ///< At most kBrickShift.
};

/// Ratio of the largest and the smallest size in a class. A search near a point uses the reach of
/// the largest particle of each class. With a smaller ratio it finds fewer particles that do not
/// reach the point, but visits more rows of cells.
inline constexpr float kClassRatio = 2;
/// Enough, because sizes differ at most by the square of ReconstructionParameters::kMostSizeRatio.
inline constexpr int kMostClasses = 8;

/// Particles, sorted by brick, size class, cell (layer, row, column), position and weight.
/// Positions are in cells relative to the brick, in [0, 8), rounded to 2^-17 cells, which a float
/// holds exactly.
struct SpaceBins {
  BrickDirectory bricks;
  /// Classes with particles in this frame, largest sizes first; one class for equal sizes.
  std::vector<SizeClass> classes{SizeClass{}};
  /// By brick and class: the first particle of each cell. A class has (8 >> shift)^3 cells in a
  /// brick. All further entries are the end of the last cell.
  std::vector<std::array<std::uint32_t, kBrickNodes + 1>> cells;
  /// kBinPadding values follow the last particle, so that vectors may read beyond it.
  std::vector<float> x, y, z;
  std::vector<float> weight;          ///< Padded. Empty without volumes, and also with own sizes.
  std::vector<float> size;            ///< Own sizes in spacings, padded; empty for equal sizes.
  std::vector<std::uint32_t> source;  ///< Index of the particle in the frame.
  /// The first image: particles of the frame from this index on are images of other particles. They
  /// count for F, but not as particles of a body. First come copies beyond the faces of a periodic
  /// box, then mirror images behind walls. kNoIndex: no images.
  std::uint32_t first_image = kNoIndex;
  /// The first mirror image. Attributes of mirror images are ignored. kNoIndex: none.
  std::uint32_t first_mirror = kNoIndex;

  bool IsImage(std::uint32_t particle) const { return source[particle] >= first_image; }
  bool IsMirror(std::uint32_t particle) const { return source[particle] >= first_mirror; }

  struct Keyed {
    std::uint64_t key;  // Class, cell and place in the cell.
    std::uint32_t source;
  };
  /// A box around the particles of a home brick, which is a brick with particles. In cells from the
  /// brick. With own sizes, it is wider by (size - 1) kernel radii around each particle.
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

  /// The indices of the particles of a brick are [FirstOf, EndOf).
  std::uint32_t FirstOf(std::size_t brick) const { return cells[brick * classes.size()].front(); }
  std::uint32_t EndOf(std::size_t brick) const {
    return cells[(brick + 1) * classes.size() - 1].back();
  }
};

/// The caller's particles from which the particles of a frame were derived, for errors.
struct GivenParticles {
  /// The caller's number of each particle from `first` on. Empty: the frame is the caller's.
  std::span<const std::uint32_t> originals = {};
  std::size_t first = 0;  ///< Particles before it have the caller's numbers.

  /// The caller's number of a particle of the frame.
  std::size_t Of(std::size_t particle) const {
    return particle < first || originals.empty() ? particle : originals[particle - first];
  }
};

/// Finds the bricks and the size classes of a frame. A brick exists if one of its nodes may be
/// within the kernel radius plus one cell of a particle. Requires: CheckFrame has passed the frame
/// as for a slice, with three components. Errors with a Violation: INVALID_ARGUMENT for coordinates
/// beyond 2^30 cells; RESOURCE_EXHAUSTED for more than `max_tiles` bricks. They name the particles
/// of `given`.
absl::Status FindBricks(const Frame& frame, const Scale& scale, const FrameLimits& limits,
                        SpaceBins& bins, const GivenParticles& given = {});

/// Sorts the particles into cells. Requires: FindBricks for the same frame.
void SortParticles(const Frame& frame, const Scale& scale, SpaceBins& bins);

/// Calls FindBricks, then SortParticles.
inline absl::Status BinParticles(const Frame& frame, const Scale& scale, const FrameLimits& limits,
                                 SpaceBins& bins) {
  absl::Status status = FindBricks(frame, scale, limits, bins);
  if (status.ok()) SortParticles(frame, scale, bins);
  return status;
}

}  // namespace partiemc::space
