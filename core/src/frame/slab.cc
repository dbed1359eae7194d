#include "frame/slab.h"

#include <algorithm>
#include <cmath>

namespace partiemc {
namespace {

using Vector = std::array<double, 3>;

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Returns the unit vector along `v`. Scales `v` first, so that squares stay in range. Requires: `v`
// is not 0.
Vector UnitOf(Vector v) {
  const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  for (double& component : v) component /= largest;
  const double length = std::sqrt(Dot(v, v));
  for (double& component : v) component /= length;
  return v;
}

}  // namespace

PlaneBasis BasisOf(const SlicePlane& plane) {
  const Vector n = UnitOf(plane.normal);
  const bool leans_to_x = std::abs(n[0]) > std::max(std::abs(n[1]), std::abs(n[2]));
  const std::size_t axis = leans_to_x ? 1 : 0;
  Vector along{};
  along[axis] = 1;
  for (std::size_t k = 0; k < 3; ++k) along[k] -= n[axis] * n[k];
  const Vector u = UnitOf(along);
  const Vector v{n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0]};
  return {plane.origin, u, v, n};
}

template <typename Real>
void Slab::Choose(std::span<const Real> positions, const PlaneBasis& basis, double reach) {
  for (std::size_t k = 0; 3 * k < positions.size(); ++k) {
    const Vector from{static_cast<double>(positions[3 * k]) - basis.origin[0],
                      static_cast<double>(positions[3 * k + 1]) - basis.origin[1],
                      static_cast<double>(positions[3 * k + 2]) - basis.origin[2]};
    const double height = Dot(from, basis.normal);
    if (!(std::abs(height) < reach)) continue;
    sources_.push_back(static_cast<std::uint32_t>(k));
    heights_.push_back(height);
    positions_.push_back(Dot(from, basis.first));
    positions_.push_back(Dot(from, basis.second));
  }
}

void Slab::Take(const Frame& frame, const SlicePlane& plane, double reach) {
  sources_.clear();
  heights_.clear();
  positions_.clear();
  const PlaneBasis basis = BasisOf(plane);
  std::visit([&](auto positions) { Choose(positions, basis, reach); }, frame.positions);

  velocities_.clear();
  for (const std::uint32_t k : sources_) {
    if (frame.velocities.empty()) continue;
    const float* const from = frame.velocities.data() + 3 * std::size_t{k};
    const Vector velocity{from[0], from[1], from[2]};
    velocities_.push_back(static_cast<float>(Dot(velocity, basis.first)));
    velocities_.push_back(static_cast<float>(Dot(velocity, basis.second)));
  }
  copy_.Take(frame, sources_);
}

Frame Slab::AsFrame() const {
  Frame frame{
      .positions = std::span<const double>(positions_), .components = 2, .velocities = velocities_};
  copy_.View(frame);
  return frame;
}

}  // namespace partiemc
