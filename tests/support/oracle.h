// The method of the paper by brute force in double precision: the reference for the stages. Every
// function follows its equation; no code is shared with the core.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "partiemc/parameters.h"
#include "support/particles.h"

namespace partiemc::support {

struct Vector {
  double x = 0, y = 0;
};

/// The level set of a frame in world units, as sums over all particles.
class FieldOracle {
 public:
  /// Requires: resolved parameters; `particles` outlives the oracle.
  FieldOracle(const Particles& particles, const ReconstructionParameters& parameters,
              double spacing);

  double KernelSum(Vector at) const;            ///< sum k
  double Density(Vector at) const;              ///< f, Eq. 1
  std::optional<Vector> Mean(Vector at) const;  ///< xbar, Eq. 3-4; empty without support.
  double Phi(Vector at) const;                  ///< Eq. 5; R - r without support.
  double Guard(Vector at) const;                ///< (g - f) R / 1.164
  double Spread(Vector at) const;               ///< s; 0 without support.
  double Gap(Vector at) const;                  ///< (s - s0) R / 0.45
  double Saturation(Vector at) const;           ///< (t - f) R / 1.164
  double Value(Vector at) const;                ///< F = min(max(phi, guard, gap), saturation)
  double CreaseMargin(Vector at) const;   ///< Difference between F and its nearest other branch.
  Vector PhiGradient(Vector at) const;    ///< By central differences.
  Vector ValueGradient(Vector at) const;  ///< By central differences.
  double kernel_radius() const { return radius_; }

 private:
  double Kernel(std::size_t particle, Vector at) const;
  template <typename Function>
  Vector CentralDifferences(Function function, Vector at) const;

  const Particles& particles_;
  double radius_, reference_radius_, guard_;
  std::vector<double> weights_;
};

/// Section 3.5: the particle farthest along the unit normal, among those on or above the plane and
/// within one cell of its point. Empty if there is none, or if rounding could change the choice:
/// then `is_close_call` is set.
struct FarthestChoice {
  std::optional<std::size_t> particle;
  bool is_close_call = false;
};
FarthestChoice FarthestParticle(const Particles& particles, Vector point, Vector normal,
                                double cell_size);

/// Segments of one cell as (entry edge, exit edge), with the inside on the left, from the values at
/// its corners, counter-clockwise from the lower left; edge k joins corners k and k + 1.
std::vector<std::pair<int, int>> CellSegments(const std::array<double, 4>& corners);

/// Median over particles of the distance to the nearest other position.
double MedianNearestNeighbour(const Particles& particles);

}  // namespace partiemc::support
