// The reference radius that puts a flat boundary h/2 outside the outermost particles.
#pragma once

#include "partiemc/parameters.h"

namespace partiemc {

/// alpha_r of Eq. 7 in spacings for a kernel radius of `kernel_radius` spacings: the value for an
/// axis-aligned lattice (core/METHOD.md, "Calibration") times the factor of the placement.
double CalibratedReferenceRadius(Placement placement, double kernel_radius);

/// The same for slices of particles in space, of any placement: balls and tori cut at many heights
/// want no factor (core/METHOD.md, "Slices").
double CalibratedSliceRadius(double kernel_radius);

}  // namespace partiemc
