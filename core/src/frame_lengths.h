// Determines the spacing and the lattice of a frame, and finds the doubts about them.
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

/// Spacing and cell size of a frame, in world units.
struct Lengths {
  double spacing, cell_size;
  bool is_provisional = false;  ///< No spacing is given, and no frame so far agreed on one.
};

/// Returns the lengths of a checked frame. They come from the parameters, else from the state, else
/// from the particles. The spacing of own sizes is then their root mean square, so the lattice
/// keeps its number of nodes per particle. For grains see ReconstructionParameters::boundary. Empty
/// if the particles give no estimate. Errors: INVALID_ARGUMENT if the spacing on which the
/// particles agree is out of range.
absl::StatusOr<std::optional<Lengths>> DecideLengths(const ReconstructionParameters& parameters,
                                                     const Frame& frame, const State& state,
                                                     SpacingScratch& scratch);

/// Returns the smallest volume of the frame, or `usual` if the particles have no volumes. `usual`
/// is h^2, of a slice h^3. Adds the doubts about volumes. Errors: INVALID_ARGUMENT for a volume too
/// far from `usual`.
absl::StatusOr<double> LightestVolume(const Frame& frame, double usual, Doubts& doubts);

/// Returns the range of the sizes of a frame with own sizes; with `parameters.slice`, particles
/// fill space, as for a surface. Errors: INVALID_ARGUMENT for the size that is farthest from the
/// spacing, if it is out of range (ReconstructionParameters::sizes and boundary).
absl::StatusOr<SizeRange> RangeOfSizes(const Frame& frame,
                                       const ReconstructionParameters& parameters,
                                       const Lengths& lengths);

/// Adds the doubts about spacing and resolution. Grains get no doubt about the spacing, because
/// they need not touch. A slab gets no doubt about the spacing, because its particles, seen from
/// above the plane, do not show the spacing. Errors: as CheckResolution (resolution.h), except if
/// lengths are provisional.
absl::Status JudgeLengths(const Frame& frame, Plane plane, const Lengths& lengths,
                          const Scale& scale, const ParticleBins& bins, Doubts& doubts);

}  // namespace partiemc
