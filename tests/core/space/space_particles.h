// Frames in space to test with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "partiemc/frame.h"
#include "support/random.h"

namespace partiemc::support {

/// A frame in space that owns its particles.
struct SpaceParticles {
  std::vector<double> xyz;
  std::vector<float> volumes;  ///< Empty, or one per particle.

  std::size_t size() const { return xyz.size() / 3; }
  void Add(const Vec3& at) { xyz.insert(xyz.end(), {at.x, at.y, at.z}); }
  void Add(const SpaceParticles& others) {
    xyz.insert(xyz.end(), others.xyz.begin(), others.xyz.end());
  }
  Vec3 At(std::size_t k) const { return {xyz[3 * k], xyz[3 * k + 1], xyz[3 * k + 2]}; }
  /// A view; valid as long as this object is and does not change.
  Frame AsFrame() const;
};

// Particles at the nodes of a lattice of spacing 1, shaken by up to `shake` along each axis.
SpaceParticles Ball(const Vec3& centre, double radius, double shake, support::Random& random);
SpaceParticles Box(const Vec3& low, const Vec3& high, double shake, support::Random& random);

/// One of: blobs, sheets, drops, noise, degenerate positions, several of them; near the origin or
/// up to 1e6 from it, some with volumes, some rounded to float32 coordinates.
SpaceParticles RandomSpaceScene(std::uint64_t seed);

SpaceParticles Shuffled(const SpaceParticles& particles, support::Random& random);

}  // namespace partiemc::support
