// The reference radius that places a flat boundary h/2 outside the outermost particles.
#pragma once

#include "partiemc/parameters.h"

namespace partiemc {

/// The reference radius alpha_r (paper, Eq. 7) in spacings: the value for an axis-aligned lattice
/// (core/METHOD.md, "Calibration") times the factor of the placement. `kernel_radius` in spacings.
double CalibratedReferenceRadius(Placement placement, double kernel_radius);

/// The kernel radius and the reference radius for Boundary::kGrains, in diameters (core/SIZES.md,
/// "Grains"). With this kernel radius, the largest grain, ten times the smallest, reaches 32 cells
/// of half the smallest diameter: exactly one tile. The reference radius matters only between
/// grains. If it is larger, the outline has shallower dimples and smaller voids.
inline constexpr double kGrainKernelRadius = 1.6, kGrainReferenceRadius = 0.3;

/// The reference radius of slices in spacings, for every placement: the value for an axis-aligned
/// lattice in space. The value needs no factor, as tests with balls and tori cut at many heights
/// show (core/METHOD.md, "Slices").
double CalibratedSliceRadius(double kernel_radius);

/// The reference radius of surfaces in spacings, for every placement: 1.065 times the radius of
/// slices (core/SURFACES.md, "Calibration").
double CalibratedSurfaceRadius(double kernel_radius);

}  // namespace partiemc
