// Lifts the particles of a periodic box to open space, so that no body is cut by a face of the box.
// Bodies that reach their own image cannot be lifted. Their particles get copies beyond the faces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "base/vec3.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "periodic/cell_groups.h"
#include "periodic/image_sets.h"

namespace partiemc {

/// In kernel radii of the largest particle: copies of percolating bodies reach kCopyMargin beyond
/// the box, at most one length. A body, field or window that stays kCopyEnd away from the end of
/// the copies does not depend on it. Means along a whole ring (vertices/virtual_plane.cc) do, but
/// little.
inline constexpr double kCopyMargin = 6, kCopyEnd = 2;

/// The particles of one cell of the grid in which Lift searches neighbours.
struct LiftCell {
  GridCell at{};
  std::uint32_t first = 0, last = 0;  ///< Its particles, [first, last) in the order of the cells.
  Vec3 low, high;                     ///< Bounding box of its particles, wrapped into the box.
  Image image{};                      ///< Image into which its particles are lifted.
  /// The axes along which the cluster percolates, a bit each; for the first cell of the cluster.
  std::uint8_t percolates = 0;
};

/// Scratch of Lift.
struct LiftScratch {
  std::vector<GridCell> cell_of;  // By particle.
  CellGroups groups;              // The particles of each cell.
  std::vector<Vec3> wrapped;      // In the order of `groups`.
  std::vector<LiftCell> cells;    // In the order of `groups`.
  ImageSets sets;                 // Of cells.
  std::vector<Vec3> low, high;    // By root: bounding box of the lifted cluster.
  // The result: the particles of the frame, then the copies.
  std::vector<double> positions;
  std::vector<std::uint32_t> originals;  // By copy: the particle.
  std::vector<float> volumes, velocities;
  std::vector<std::uint64_t> ids;
  std::vector<std::vector<float>> values;  // By attribute.
  std::vector<Attribute> attributes;
};

/// Bytes of a LiftScratch without copies of particles, at most. Per particle: `cell_of`, `wrapped`,
/// `positions` in space, `groups`. Per cell: `cells`, `sets`, `low`, `high`, `groups`.
inline constexpr std::uint64_t kBytesPerLiftedParticle = 60 + kBytesPerGroupedItem;
inline constexpr std::uint64_t kBytesPerLiftCell = sizeof(LiftCell) + sizeof(std::uint32_t) +
                                                   sizeof(Image) + 2 * sizeof(Vec3) +
                                                   kBytesPerCellGroup;

struct LiftInput {
  const Frame& frame;
  const PeriodicBox& box;
  /// By particle: the caller's number of it, for errors. Empty: its index in `frame`.
  std::span<const std::uint32_t> names = {};
  /// The coordinates that count: two for outlines, three for surfaces. The others stay as they are.
  std::span<const int> axes;
  /// Particles at most this far apart are in one cluster. World units.
  double range;
  /// Copies of percolating clusters reach this far beyond the faces, along each axis at most one
  /// length of the box. World units. 0: such clusters are refused.
  double margin;
  /// Treats all particles as percolating along all periodic axes: every particle is wrapped into
  /// the box, and particles within `margin` of a face get copies.
  bool wraps = false;
  /// Called two or three times with all bytes that the scratch requires so far, before they are
  /// allocated: for particles, with cells, and with copies if there are any. Its error ends Lift.
  absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve;
};

/// A frame in open space.
struct LiftedFrame {
  Frame frame;                ///< The given particles in their order, then the copies.
  std::size_t particles = 0;  ///< Number of given particles.
  std::span<const std::uint32_t> originals;  ///< By copy: the index of the given particle.
  std::array<bool, 3> percolates{};          ///< Axes along which a cluster percolates.

  /// The given particle of a particle of `frame`.
  std::uint32_t OriginalOf(std::uint32_t particle) const {
    return particle < particles ? particle : originals[particle - particles];
  }
};

/// Moves each particle by whole lengths of the box, so that clusters are contiguous and the centre
/// of each cluster's bounding box lies in the box. A cluster is a set of particles that are
/// connected by distances of at most `range` in the periodic box. Sets `lifted` to the frame with
/// the new positions, a view of `scratch`. A particle that does not move keeps the bits of its
/// position.
///
/// A cluster percolates along an axis if it reaches its own image along this axis. Along such axes,
/// its particles are wrapped into the box, and those within `margin` of a face get copies beyond
/// the opposite face. If clusters percolate along different axes, as they can in space, each
/// percolating cluster counts as percolating along all these axes. A copy has the id, volume,
/// velocity and attributes of its particle.
///
/// Two cells of the grid with very many particles may be joined although their particles are up to
/// two ranges apart, so that the cost is bounded (kMostPairs in lift.cc).
/// Requires: CheckFrame has passed the frame; Validate has passed the box for `range` = two kernel
/// radii.
/// Errors: INVALID_ARGUMENT: OUT_OF_RANGE if a periodic axis is not one of `axes`, or a particle is
/// more than 1e6 lengths away from the box; PERCOLATES if a cluster percolates and `margin` is 0;
/// TOO_MANY_PARTICLES if there are more than FrameLimits::kMostParticles with the copies; errors of
/// `reserve`. Positions depend neither on the order of the particles nor on the number of threads.
/// Copies are in the order of the cells of the grid, then of their particles. Cost: linear in
/// particles, n log n in cells.
absl::Status Lift(const LiftInput& input, LiftScratch& scratch, LiftedFrame& lifted);

}  // namespace partiemc
