// Particles and sums of bodies in periodic boxes.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "partiemc/parameters.h"
#include "partiemc/surface.h"
#include "partiemc/surface_reconstructor.h"
#include "space/space_particles.h"
#include "support/tries.h"

namespace partiemc::support {

/// Periodic along the axes whose length is not 0.
inline PeriodicBox BoxOf(double x, double y, double z, const Vec3& origin = {}) {
  PeriodicBox box;
  const std::array<double, 3> lengths{x, y, z}, origins{origin.x, origin.y, origin.z};
  for (std::size_t k = 0; k < 3; ++k) {
    if (lengths[k] > 0) box.axes[k] = PeriodicAxis{origins[k], lengths[k]};
  }
  return box;
}

inline PeriodicBox Cube(double length, bool wraps = false, double origin = 0) {
  const PeriodicAxis axis{origin, length};
  return {.axes = {axis, axis, axis}, .wraps = wraps};
}

inline SurfaceParameters In(const PeriodicBox& box,
                            SurfacePlacement placement = SurfacePlacement::kVirtualPlane) {
  return {.placement = placement, .box = box};
}

/// Moves coordinates into the box, as simulators do.
inline void Wrap(std::vector<double>& xyz, const PeriodicBox& box) {
  for (std::size_t k = 0; k < xyz.size(); ++k) {
    const auto& axis = box.axes[k % 3];
    if (axis) xyz[k] -= axis->length * std::floor((xyz[k] - axis->origin) / axis->length);
  }
}

template <typename Particles>
Particles Wrapped(Particles particles, const PeriodicBox& box) {
  Wrap(particles.xyz, box);
  return particles;
}

/// Sums over the shells of a surface.
struct Sums {
  double area = 0, volume = 0;
  std::uint64_t particles = 0;
};

inline Sums SumsOf(const Surface& surface) {
  Sums sums;
  for (const ShellMeasures& measures : surface.measures) {
    sums.area += measures.area;
    sums.volume += measures.volume;
    sums.particles += measures.particles;
  }
  return sums;
}

inline void ExpectInBox(const Surface& surface, const PeriodicBox& box) {
  for (std::size_t k = 0; k < surface.points.size(); ++k) {
    const auto& axis = box.axes[k % 3];
    if (!axis) continue;
    // Faces move by up to .0002 spacings where a vertex lies on them.
    ASSERT_GE(surface.points[k], axis->origin - 1e-3);
    ASSERT_LE(surface.points[k], axis->origin + axis->length + 1e-3);
  }
}

/// The particles of a lattice with one particle in the middle of each cube, where keep(point).
template <typename Keep>
SpaceParticles Filled(int x, int y, int z, double shake, support::Random& random, Keep keep) {
  SpaceParticles particles;
  for (int k = 0; k < z; ++k) {
    for (int j = 0; j < y; ++j) {
      for (int i = 0; i < x; ++i) {
        const Vec3 at{i + .5, j + .5, k + .5};
        if (!keep(at)) continue;
        const double a = random.Uniform(-shake, shake), b = random.Uniform(-shake, shake);
        particles.Add(at + Vec3{a, b, random.Uniform(-shake, shake)});
      }
    }
  }
  return particles;
}

/// `count` particles at random points of a box from the origin.
inline SpaceParticles Uniform(std::size_t count, const Vec3& lengths, support::Random& random) {
  SpaceParticles particles;
  for (; count > 0; --count) {
    const double x = random.Uniform(0, lengths.x), y = random.Uniform(0, lengths.y);
    particles.Add({x, y, random.Uniform(0, lengths.z)});
  }
  return particles;
}

}  // namespace partiemc::support
