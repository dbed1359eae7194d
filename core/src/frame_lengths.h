// Decides the spacing and the lattice of a frame, and finds the doubts about them.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "bins/bins.h"
#include "frame/scale.h"
#include "frame/spacing.h"
#include "partiemc/doubt.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"

namespace partiemc {

/// In world units.
struct Lengths {
  double spacing, cell_size;
  bool is_provisional;  ///< No spacing is given or agreed on so far.
};

/// Returns the lengths of a checked frame: from the parameters, else the state, else the particles.
/// Empty if nothing gives even an estimate. Errors: INVALID_ARGUMENT if the agreed spacing exceeds
/// its range.
absl::StatusOr<std::optional<Lengths>> DecideLengths(const ReconstructionParameters& parameters,
                                                     const Frame& frame, const State& state,
                                                     SpacingScratch& scratch);

/// Returns the smallest volume of the frame, or `usual` (h^2, of a slice h^3) if particles have
/// none. Adds the doubts about volumes. Errors: INVALID_ARGUMENT for a volume too far from `usual`.
absl::StatusOr<double> LightestVolume(const Frame& frame, double usual, Doubts& doubts);

/// Adds the doubts about spacing and resolution. A slab has no doubts about the spacing, as it does
/// not show it. Errors: as CheckResolution (resolution.h), except if lengths are provisional.
absl::Status JudgeLengths(const Frame& frame, Plane plane, const Lengths& lengths,
                          const Scale& scale, const ParticleBins& bins, Doubts& doubts);

}  // namespace partiemc
