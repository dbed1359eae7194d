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

namespace partiemc {

/// Largest displacement of a known particle between two frames, in spacings. After a larger
/// displacement a particle counts as new: its filtered position is its given position.
inline constexpr double kMostDisplacement = 5;

/// Largest distance, in spacings, of the given position from the prediction by the last frame and
/// the local motion. At a larger distance a particle counts as new.
inline constexpr double kMostSurprise = 1;

/// Warm buffers of FilterNoise.
struct NoiseFilterScratch {
  /// A particle that both frames have.
  struct Known {
    MotionCellCoordinate cell;
    std::uint32_t rank;  // In the order of the ids.
  };
  std::vector<std::uint32_t> particles;  // By rank: index in the frame.
  std::vector<std::uint32_t> last;       // By rank: index in the last history.
  std::vector<Known> known;              // By cell, then rank.
  std::vector<Mover> movers;             // As `known`.
  std::vector<MotionCell> cells;
  std::vector<double> positions;  // The result.
  NoiseHistory next;              // The history for the next frame.
};

/// Bytes of a NoiseFilterScratch and of the history of a state, at most.
inline constexpr std::uint64_t kBytesPerFilteredParticle = 192;
inline constexpr std::uint64_t kBytesPerMotionCell = 224;

struct NoiseFilterInput {
  const Frame& frame;
  /// The coordinates that are filtered: two for outlines, three for slices and surfaces. The others
  /// stay as they are.
  std::span<const int> axes;
  double weight;              ///< ReconstructionParameters::noise_filter.
  double spacing, cell_size;  ///< World units. The cell size is the same for all frames.
  const std::optional<PeriodicBox>& box;
  const NoiseHistory& previous;
  /// Called twice with the bytes that the filter requires, before they are allocated: a lower bound
  /// by particles, then the sum. Its error ends the filter.
  absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve;
};

/// Sets `filtered` to the frame with filtered positions, a view of `scratch`, and `scratch.next` to
/// the history for the next frame. The result depends neither on the order of the particles nor on
/// the number of threads.
/// Requires: CheckFrame has passed the frame, which has ids; the history is empty or has
/// `axes.size()` coordinates per particle; Validate has passed the box for this spacing.
/// Errors: as `reserve`. Cost: n log n in particles, however close they are.
absl::Status FilterNoise(const NoiseFilterInput& input, NoiseFilterScratch& scratch,
                         Frame& filtered);

}  // namespace partiemc
