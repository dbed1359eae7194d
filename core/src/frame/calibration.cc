#include "frame/calibration.h"

#include <cmath>

#include "frame/placement_traits.h"

namespace partiemc {
namespace {

// For particles on an axis-aligned lattice that fills a half plane: the distance, in spacings, from
// a point h/2 outside the outermost layer to the weighted mean of the particles. Layer k is at the
// distance d = k + 1/2. The weight of a layer is the kernel integrated along the layer,
// proportional to (1 - (d / beta)^2)^(7/2); in space the exponent is 4.
template <bool kInSpace>
double AxisAlignedLatticeDistance(double beta) {
  double moment = 0;
  double weight = 0;
  for (double d = 0.5; d < beta; d += 1) {
    const double t = 1 - (d / beta) * (d / beta);
    const double w = t * t * t * (kInSpace ? t : std::sqrt(t));
    moment += w * d;
    weight += w;
  }
  return moment / weight;
}

}  // namespace

double CalibratedReferenceRadius(Placement placement, double kernel_radius) {
  return TraitsOf(placement).calibration * AxisAlignedLatticeDistance<false>(kernel_radius);
}

double CalibratedSliceRadius(double kernel_radius) {
  return AxisAlignedLatticeDistance<true>(kernel_radius);
}

double CalibratedSurfaceRadius(double kernel_radius) {
  constexpr double kFactor = 1.065;
  return kFactor * CalibratedSliceRadius(kernel_radius);
}

}  // namespace partiemc
