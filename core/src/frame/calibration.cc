#include "frame/calibration.h"

#include <cmath>

namespace partiemc {
namespace {

// What a whole chain wants on top of an axis-aligned lattice for no mean offset on discs under
// relaxed sampling (core/METHOD.md, "Calibration"): the linear interpolation of marching squares
// cuts the contour's bulge off and so wants more, vertices on the level set less.
// `farthest-particle` takes only its topology from the level set.
double Factor(Placement placement) {
  switch (placement) {
    case Placement::kMarchingSquares:
      return 1.09;
    case Placement::kQef:
      return 1.085;
    case Placement::kFarthestParticle:
      return 1.0;
    case Placement::kVirtualPlane:
      return 1.05;
  }
  return 1.0;
}

// Distance of the weighted mean from a point h/2 outside the outermost layer of an axis-aligned
// lattice, in spacings: layers lie at d = k + 1/2, and the kernel integrated along a layer is
// proportional to (1 - (d / beta)^2)^(7/2).
double AxisAlignedLatticeDistance(double beta) {
  double moment = 0;
  double weight = 0;
  for (double d = 0.5; d < beta; d += 1) {
    const double t = 1 - (d / beta) * (d / beta);
    const double w = t * t * t * std::sqrt(t);
    moment += w * d;
    weight += w;
  }
  return moment / weight;
}

}  // namespace

double CalibratedReferenceRadius(Placement placement, double kernel_radius) {
  return Factor(placement) * AxisAlignedLatticeDistance(kernel_radius);
}

}  // namespace partiemc
