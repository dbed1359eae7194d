#include "frame/calibration.h"

#include <cmath>

#include "frame/placement_traits.h"

namespace partiemc {
namespace {

// Distance of the weighted mean from a point h/2 outside the outermost layer of an axis-aligned
// lattice, in spacings. Layers lie at d = k + 1/2; the kernel integrated along a layer is
// proportional to (1 - (d / beta)^2)^(7/2), in space ^4.
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

}  // namespace partiemc
