// Spacing and lattice of a frame: where they come from, and what speaks against them.
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
  bool is_provisional;  ///< No spacing is given, and no frame so far has agreed on one.
};

/// The lengths of a checked frame, by parameters, state and the particles themselves, in this
/// order; nothing while there is not even a guess. Errors: INVALID_ARGUMENT for a spacing that the
/// particles agree on but that is out of range.
absl::StatusOr<std::optional<Lengths>> DecideLengths(const ReconstructionParameters& parameters,
                                                     const Frame& frame, const State& state,
                                                     SpacingScratch& scratch);

/// The smallest volume of the frame, `usual` where particles have none: h^2, of a slice h^3. Adds
/// the doubt that volumes give reason for. Errors: INVALID_ARGUMENT for a volume that is too far
/// from the usual one.
absl::StatusOr<double> LightestVolume(const Frame& frame, double usual, Doubts& doubts);

/// Adds the doubts that the bins give reason for. Errors: see CheckResolution (resolution.h); none
/// where lengths are provisional. Particles of a slab tell nothing of their spacing.
absl::Status JudgeLengths(const Frame& frame, Plane plane, const Lengths& lengths,
                          const Scale& scale, const ParticleBins& bins, Doubts& doubts);

}  // namespace partiemc
