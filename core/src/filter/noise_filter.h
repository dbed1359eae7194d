// Filters the noise of particle positions from frame to frame (core/NOISE.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "filter/local_motion.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"
#include "periodic/cell_groups.h"
#include "periodic/frame_box.h"

namespace partiemc {

/// Largest displacement of a known particle between two frames, in spacings. A particle that moved
/// farther counts as new: its filtered position is its given position.
inline constexpr double kMostDisplacement = 5;

/// Largest distance, in spacings, of the given position from the prediction by the last frame and
/// the local motion. At a larger distance a particle counts as new.
inline constexpr double kMostSurprise = 1;

/// Warm buffers of FilterNoise.
struct NoiseFilterScratch {
  // The rank of a particle is its place in the order of the ids.
  std::vector<std::uint32_t> particles;  // By rank: index in the frame.
  std::vector<std::uint32_t> last;       // By rank: index in the last history.
  std::vector<std::uint32_t> known;      // Ranks of the particles that both frames have.
  std::vector<GridCell> cell_of;         // As `known`.
  CellGroups groups;                     // The known particles of each cell.
  std::vector<Mover> movers;             // In the order of `groups`.
  std::vector<MotionCell> cells;
  std::vector<double> positions;  // The result.
  NoiseHistory next;              // The history for the next frame.
};

/// Upper bounds of the bytes of a NoiseFilterScratch and of the history of a state.
inline constexpr std::uint64_t kBytesPerFilteredParticle = 216;
inline constexpr std::uint64_t kBytesPerMotionCell = 248;

struct NoiseFilterInput {
  const Frame& frame;
  /// The coordinates that are filtered: two for outlines, three for slices and surfaces. The others
  /// stay as they are.
  std::span<const int> axes;
  double weight;              ///< ReconstructionParameters::noise_filter.
  double spacing, cell_size;  ///< World units. The cell size is the same for all frames.
  const std::optional<PeriodicBox>& box;
  const BoxMotion& motion;  ///< Motion of the box since the last frame. World units.
  std::optional<PeriodicBox> box_to_store;  ///< For NoiseHistory::box.
  const NoiseHistory& previous;
  /// The filter calls this twice with the bytes that it requires, before it allocates them: first
  /// the bytes for particles, then the sum with those for cells. An error ends the filter.
  absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve;
};

/// Sets `filtered` to the frame with filtered positions, a view of `scratch`, and `scratch.next` to
/// the history for the next frame. The result depends neither on the order of the particles nor on
/// the number of threads.
/// Requires: CheckFrame has passed the frame, which has ids; the history is empty or has
/// `axes.size()` coordinates per particle; Validate has passed the box for this spacing.
/// Errors: as `reserve`. Cost: linear in particles, however close they are; n log n in cells.
absl::Status FilterNoise(const NoiseFilterInput& input, NoiseFilterScratch& scratch,
                         Frame& filtered);

}  // namespace partiemc
