// Outlines in a periodic box: lifts the particles before the stages, and cuts the rings of bodies
// that percolate after them (core/PERIODIC.md).
#pragma once

#include <cstdint>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "frame_lengths.h"
#include "partiemc/doubt.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "periodic/lift.h"
#include "periodic/run_periods.h"
#include "rings/percolation.h"

namespace partiemc {

/// What is known about a frame in a periodic box before its outlines.
struct PeriodicFrame {
  std::optional<Lengths> lengths;
  Doubts doubts;
  LiftedFrame lifted;
  Window window;     ///< The box along the axes along which bodies percolate.
  double reach = 0;  ///< Bodies are complete up to this far beyond the window. World units.

  bool HasCopies() const { return !lifted.originals.empty(); }
};

/// Lifts the particles of a checked frame (periodic/lift.h). `periodic.lengths` must be set; if
/// they are empty, nothing is lifted. Errors: those of Lift, and of Validate for the box.
absl::Status LiftOutline(const ReconstructionParameters& parameters, const Frame& given,
                         absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve,
                         LiftScratch& scratch, PeriodicFrame& periodic);

/// The periods of the lattice; without a box, none.
LatticePeriods PeriodsOf(const ReconstructionParameters& parameters, const Frame& frame,
                         double cell_size);

}  // namespace partiemc
