// Determines the spacing and the lattice of a frame, and finds the doubts about them.
#pragma once

#include <optional>
#include <span>

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

/// The root mean square of the sizes of particles with these areas. Requires: at least one.
double SpacingOfSizes(std::span<const float> volumes);

/// Returns the lengths of a checked frame. The cell size comes from the state, if it has one. The
/// spacing comes from the parameters, else, with SpacingRule::kFirstFrame, from the state, else
/// from particles that agree on one (own sizes always do), else from the state. Without any of
/// these, the lengths are provisional. Empty if the particles give no estimate either. Errors:
/// INVALID_ARGUMENT if the spacing on which the particles agree is out of range.
absl::StatusOr<std::optional<Lengths>> DecideLengths(const ReconstructionParameters& parameters,
                                                     const Frame& frame, const State& state,
                                                     SpacingScratch& scratch);

/// Returns the smallest volume of the frame, or `usual` if the particles have no volumes. `usual`
/// is h^2, for slices and surfaces h^3. Adds kVolumesContradictSpacing. Errors: INVALID_ARGUMENT
/// for a volume that differs from `usual` by more than a factor of 1e6.
absl::StatusOr<double> LightestVolume(const Frame& frame, double usual, Doubts& doubts);

/// Returns the range of the sizes of a frame with own sizes. `parameters.slice` must be set if
/// particles fill space, also for a surface. Errors: INVALID_ARGUMENT for the smallest or the
/// largest size, if it is out of range (ReconstructionParameters::sizes and boundary).
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
