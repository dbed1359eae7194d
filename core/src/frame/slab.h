// The particles near a plane in space, as a frame in that plane.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "frame/particle_copy.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// A right-handed orthonormal basis: a point is origin + u first + v second + height normal, and
/// (u, v) are the coordinates of results.
struct PlaneBasis {
  std::array<double, 3> origin, first, second, normal;
};

/// The basis of a plane, as SlicePlane::normal defines it. Requires: Validate has passed the plane.
PlaneBasis BasisOf(const SlicePlane& plane);

/// The particles within some distance of a plane, in the order of their frame, as a copy.
class Slab {
 public:
  /// Selects the particles of `frame` within `reach` (world units) of the plane and copies them.
  /// Requires: three components, and CheckFrame has passed the frame. Cost: linear.
  void Take(const Frame& frame, const SlicePlane& plane, double reach);

  /// The slab as a frame in the plane: positions and velocities along the plane; volumes, ids,
  /// attributes and time unchanged. The arrays are views of this slab. The names of attributes are
  /// views of the frame that Take has read.
  Frame AsFrame() const;

  /// By particle: its signed distance from the plane in world units.
  std::span<const double> heights() const { return heights_; }

  /// By particle: its index in the original frame.
  std::span<const std::uint32_t> sources() const { return sources_; }

 private:
  template <typename Real>
  void Choose(std::span<const Real> positions, const PlaneBasis& basis, double reach);

  std::vector<std::uint32_t> sources_;
  std::vector<double> positions_, heights_;
  std::vector<float> velocities_;
  ParticleCopy copy_;
};

}  // namespace partiemc
