// The lengths of one frame in cells.
#pragma once

#include <algorithm>

#include "partiemc/parameters.h"

namespace partiemc {

/// The smallest and the largest size of the particles of a frame, in spacings.
struct SizeRange {
  double smallest = 1, largest = 1;

  /// The factor of lengths in a periodic box that are given in kernel radii R = beta h. The kernel
  /// of the largest particle has its radius; cells have the spacing, so the factor is at least 1.
  double Reach() const { return std::max(1.0, largest); }
};

/// Parameters, spacing and lattice in the form that the stages use. Lengths are in cells (lattice
/// spacings) unless noted otherwise.
struct Scale {
  double cell_size = 0;          ///< World units.
  bool is_slice = false;         ///< Slice or surface: particles fill space; volumes are cubic.
  bool has_own_sizes = false;    ///< Sizes::kOwn: particle i has the kernel radius beta h_i.
  bool has_grains = false;       ///< Boundary::kGrains: particles are discs.
  SizeRange sizes;               ///< Both 1 for Sizes::kEqual.
  double spacing = 0;            ///< h.
  double kernel_radius = 0;      ///< R = beta h.
  double reach = 0;              ///< The largest kernel radius of a particle.
  double reference_radius = 0;   ///< r_0 = alpha_r h.
  double uniform_weight = 0;     ///< w of a particle of volume h^2 (slice: h^3); gives f of about 1
                                 ///< inside.
  double weight_per_volume = 0;  ///< w of a particle of volume 1 cell^2 (slice: 1 cell^3).
  double guard = 0;              ///< f_0: points with a lower f are outside.
  double saturation = 0;         ///< f_1: points with a higher f are inside.
  double guard_slope = 0;        ///< R / 1.164 (slice: R / 1.23): converts density to a length.
  double gap_spread = 0;         ///< sigma_0: points with a larger spread are in a gap.
  double gap_slope = 0;          ///< R / 0.45: converts spread to a length.
};

/// The unit of ReconstructionParameters::cell_size, in spacings: 0.5 for grains, else 1.
double CellUnit(const ReconstructionParameters& parameters);

/// Makes the scale of a frame. Arguments are in world units, except `sizes`.
///   spacing: h.
///   lightest_volume: the smallest volume of a particle in the frame; an area unless
///     parameters.slice is set. Surfaces set it, too. `lightest_volume` limits f_0, so that a lone
///     particle of this volume has an outline. If particles have no volumes, it is h^2, or with
///     parameters.slice h^3. Also for Sizes::kOwn, because weights then do not contain volumes.
///   sizes: in spacings; both 1 except for Sizes::kOwn.
/// Requires: resolved parameters.
Scale MakeScale(const ReconstructionParameters& parameters, double spacing, double cell_size,
                double lightest_volume, const SizeRange& sizes = {});

}  // namespace partiemc
