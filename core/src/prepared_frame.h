// Prepares a frame for its outlines or its surface: filters noise, lifts particles out of a
// periodic box.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "absl/status/status.h"
#include "filter/noise_filter.h"
#include "frame/distinct_ids.h"
#include "frame/spacing.h"
#include "frame_lengths.h"
#include "frame_memory.h"
#include "partiemc/doubt.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"
#include "periodic/frame_box.h"
#include "periodic/lift.h"
#include "periodic/run_periods.h"
#include "rings/percolation.h"

namespace partiemc {

/// A frame that was filtered, lifted or divided from its walls before its outlines.
struct Prepared {
  std::optional<Lengths> lengths;  ///< Empty: the particles give no estimate.
  Doubts doubts;
  double largest_size = 1;  ///< An upper bound, at least 1, of the sizes of all given particles, in
                            ///< spacings.
  bool is_filtered = false, is_lifted = false;
  LiftedFrame lifted;  ///< Unless `is_lifted`: the given particles, no copies.
  Window window;       ///< The box along the axes along which bodies percolate.
  /// Images of bodies are complete if they end at most this far beyond the window, along each of
  /// its axes. World units.
  std::array<double, 2> reach{};

  bool HasCopies() const { return !lifted.originals.empty(); }
};

struct PreparationInput {
  const ReconstructionParameters& parameters;
  const FrameLimits& limits;
  const Frame& given;  ///< After ResolveBox.
  const State& state;
  /// By particle: the caller's number of it, for errors. Empty: its index.
  std::span<const std::uint32_t> names = {};
};

struct PreparationScratch {
  DistinctIdsScratch& distinct_ids;
  SpacingScratch& spacing;
  NoiseFilterScratch& noise;
  LiftScratch& lift;
};

/// Whether frames need PrepareFrame. SurfaceReconstructor lifts its frames itself.
inline bool IsPrepared(const ReconstructionParameters& parameters) {
  return parameters.noise_filter || (parameters.box && parameters.output == Output::kOutline);
}

/// The motion of the box since the last frame, whose box is `before` (RingHistory::box): in cells,
/// along the axes of the plane. `frame`: after ResolveBox.
BoxMotion MotionInPlane(const ReconstructionParameters& parameters, const Frame& frame,
                        const std::optional<PeriodicBox>& before, double cell_size);

/// The periods of the lattice; without a box, none. `frame`: after ResolveBox.
LatticePeriods PeriodsOf(const ReconstructionParameters& parameters, const Frame& frame,
                         double cell_size);

/// Checks a frame, decides its lengths, and sets `frame` to the filtered and lifted frame, a view
/// of `scratch`. A frame without lengths stays as given; one with provisional lengths is not
/// filtered. Requires: IsPrepared. Errors: see Reconstructor::Reconstruct.
absl::Status PrepareFrame(const PreparationInput& input, FrameMemory& memory,
                          const PreparationScratch& scratch, Frame& frame, Prepared& prepared);

}  // namespace partiemc
