// The lengths of one frame, in cells of the lattice.
#pragma once

#include "partiemc/parameters.h"

namespace partiemc {

/// Everything that the stages need to know of parameters, spacing and lattice. Lengths in cells
/// (lattice spacings) unless a comment says otherwise: inside, the lattice has spacing 1.
struct Scale {
  double cell_size = 0;          ///< World units.
  bool is_slice = false;         ///< Of particles in space: volumes are cubes of lengths.
  double spacing = 0;            ///< h.
  double kernel_radius = 0;      ///< R = beta h.
  double reference_radius = 0;   ///< r_0 = alpha_r h.
  double uniform_weight = 0;     ///< w of a particle of volume h^2 (of a slice h^3), so that f is
                                 ///< about 1 inside.
  double weight_per_volume = 0;  ///< w of a particle of volume 1 cell^2 (of a slice 1 cell^3).
  double guard = 0;              ///< f_0: where f is below it there is no inside.
  double saturation = 0;         ///< f_1: where f is above it there is no outside.
  double guard_slope =
      0;  ///< R / 1.164, of a slice R / 1.23: turns a lack of density into a length.
  double gap_spread = 0;  ///< sigma_0: where particles are spread wider than it, there is a gap.
  double gap_slope = 0;   ///< R / 0.45: turns spread into a length.
};

/// `spacing` and `cell_size` in world units; `lightest_volume` in world units squared (h^2 where
/// particles have no volumes), for a slice cubed. Requires: resolved parameters.
Scale MakeScale(const ReconstructionParameters& parameters, double spacing, double cell_size,
                double lightest_volume);

}  // namespace partiemc
