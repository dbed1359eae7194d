#include "frame/scale.h"

#include <algorithm>

namespace partiemc {
namespace {

// The kernel (1 - s^2)^3 integrates to pi R^2 / 4 over the plane.
constexpr double kFourOverPi = 1.27323954473516268615;
// Over space the kernel integrates to 64 pi R^3 / 315.
constexpr double kSpaceNorm = 315.0 / 64 / 3.14159265358979323846;

// The guard against spurious contours (core/METHOD.md, "Spurious contours"): f_0 is at most
// 0.9 / beta^2, with beta = R / h; 0.10 at beta = 3. This value is above f in the void between two
// components and below f at a lone particle.
constexpr double kGuardFactor = 0.9;
// A lone particle must survive, so f_0 is at most this share of the density that the lightest
// particle alone has at its position.
constexpr double kGuardShareOfLightest = 0.7;
// A node with a higher density is inside, whatever the weighted mean gives. For comparison: f is
// about 1 inside, 0.5 on a flat boundary, 0.6 at the edge of a void with the area of six particles.
constexpr double kSaturation = 0.85;
// The gap term begins at this spread. The spread (sigma) at a point is the larger eigenvalue of the
// second moment of the particles about it, in R^2 (core/METHOD.md, "Notation"). It is 0.1 inside
// bodies and on their boundaries, and 0.21 in the middle of a gap of 1.7 spacings.
constexpr double kGapSpread = 0.21;
// At the distance r from a lone particle, the spread is (r / R)^2. The gap term must not cut off
// outlines with a larger reference radius r than usual, so its limit rises with (r / R)^2. The
// calibrated radii give at most 0.21.
constexpr double kGapSpreadPerReference = 2.4;
// Slope of the spread outside a flat boundary, times R.
constexpr double kSpreadSlope = 0.45;
// Slope of f across a flat boundary, times R. This slope converts the density terms of F to
// lengths.
constexpr double kBoundarySlope = 1.164;
// The slope of f across a flat boundary in space, times R. It is R times the integral of the
// normalised kernel over a plane through its centre.
constexpr double kBoundarySlopeInSpace = 315.0 / 256;

// With grains, cells of size 1 are half as wide as the smallest grain.
constexpr double kGrainCell = 0.5;
// With grains, voids of up to five touching grains are inside: there f is 0.92 or more, in the void
// of six 0.68.
constexpr double kGrainSaturation = 0.9;
// With grains, the gap term begins at this spread (see kGapSpread). Points with a larger spread are
// in a gap, which is outside. In the middle of the void of six touching grains the spread is 0.195.
// This void has room for another grain, so the limit is lower. In the middle between two grains,
// the spread is 0.17 if their gap is 0.32 diameters.
constexpr double kGrainGapSpread = 0.17;

}  // namespace

double CellUnit(const ReconstructionParameters& parameters) {
  return parameters.boundary == Boundary::kGrains ? kGrainCell : 1;
}

Scale MakeScale(const ReconstructionParameters& parameters, double spacing, double cell_size,
                double lightest_volume, const SizeRange& sizes) {
  Scale scale;
  scale.cell_size = cell_size;
  scale.spacing = spacing / cell_size;
  scale.kernel_radius = parameters.kernel_radius * scale.spacing;
  scale.reference_radius = *parameters.reference_radius * scale.spacing;
  scale.is_slice = parameters.slice.has_value();
  scale.has_own_sizes = parameters.sizes == Sizes::kOwn;
  scale.sizes = sizes;
  scale.reach = scale.kernel_radius * sizes.largest;
  const double radius_square = scale.kernel_radius * scale.kernel_radius;
  scale.weight_per_volume = scale.is_slice ? kSpaceNorm / (radius_square * scale.kernel_radius)
                                           : kFourOverPi / radius_square;
  scale.uniform_weight = scale.weight_per_volume * scale.spacing * scale.spacing;
  double lightest_weight = scale.weight_per_volume * (lightest_volume / cell_size / cell_size);
  if (scale.is_slice) {
    scale.uniform_weight *= scale.spacing;
    lightest_weight /= cell_size;
  }
  const double beta = parameters.kernel_radius;
  scale.guard = std::min(kGuardFactor / (beta * beta), kGuardShareOfLightest * lightest_weight);
  scale.saturation = kSaturation;
  scale.guard_slope =
      scale.kernel_radius / (scale.is_slice ? kBoundarySlopeInSpace : kBoundarySlope);
  // With equal limits, both density terms of F are the same, and F equals them.
  if (parameters.isovalue) scale.guard = scale.saturation = *parameters.isovalue;
  const double reference = scale.reference_radius / scale.kernel_radius;
  scale.gap_spread = std::max(kGapSpread, kGapSpreadPerReference * reference * reference);
  scale.gap_slope = scale.kernel_radius / kSpreadSlope;
  scale.has_grains = parameters.boundary == Boundary::kGrains;
  if (scale.has_grains) {
    scale.guard = 0;
    scale.saturation = kGrainSaturation;
    scale.gap_spread = kGrainGapSpread;
  }
  return scale;
}

}  // namespace partiemc
