// The particles that a plane through space sees, as a frame in that plane.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// A plane with unit vectors: a point is origin + u first + v second + height normal, and (u, v)
/// are the coordinates of results. Right-handed.
struct PlaneBasis {
  std::array<double, 3> origin, first, second, normal;
};

/// `first` is the x axis as the plane sees it, or the y axis where the normal leans to x more than
/// to y and z: of a normal along z, coordinates are x and y; along -y, x and z; along x, y and z.
/// Requires: Validate has passed the plane.
PlaneBasis BasisOf(const SlicePlane& plane);

/// Particles nearer to a plane than some reach, in the order of the frame that they are taken from.
class Slab {
 public:
  /// Takes them from a frame with three coordinates that CheckFrame has passed; `reach` in world
  /// units. Cost: a few operations for each particle of the frame, copies of those in the slab.
  void Take(const Frame& frame, const SlicePlane& plane, double reach);

  /// As a frame in the plane: positions and velocities along it, volumes, ids and attributes as
  /// they were. Views, as long as the slab stays.
  Frame AsFrame() const;

  /// By particle of the slab: its distance from the plane, in world units, signed.
  std::span<const double> heights() const { return heights_; }

  /// By particle of the slab: its index in the frame that it was taken from.
  std::span<const std::uint32_t> sources() const { return sources_; }

 private:
  template <typename Real>
  void Choose(std::span<const Real> positions, const PlaneBasis& basis, double reach);

  double time_ = 0;
  std::vector<std::uint32_t> sources_;
  std::vector<double> positions_, heights_;
  std::vector<float> volumes_, velocities_;
  std::vector<std::uint64_t> ids_;
  std::vector<std::vector<float>> values_;  // By attribute; buffers of frames so far stay.
  std::vector<Attribute> attributes_;
};

}  // namespace partiemc
