#include "space/space_particles.h"

#include <cmath>
#include <numeric>
#include <utility>

namespace partiemc::support {
namespace {

using support::Random;

Vec3 Shake(double amount, Random& random) {
  const auto along = [&] { return random.Uniform(-amount, amount); };
  const double x = along(), y = along();
  return {x, y, along()};
}

/// A lattice in the box where keep(point).
template <typename Keep>
SpaceParticles Lattice(const Vec3& low, const Vec3& high, double shake, Random& random, Keep keep) {
  SpaceParticles particles;
  for (double z = std::ceil(low.z); z <= high.z; ++z) {
    for (double y = std::ceil(low.y); y <= high.y; ++y) {
      for (double x = std::ceil(low.x); x <= high.x; ++x) {
        const Vec3 at{x, y, z};
        if (keep(at)) particles.Add(at + Shake(shake, random));
      }
    }
  }
  return particles;
}

Vec3 RandomPoint(double extent, Random& random) { return Shake(extent, random); }

SpaceParticles Blobs(Random& random) {
  SpaceParticles particles;
  for (std::size_t k = random.Below(3) + 1; k > 0; --k) {
    particles.Add(
        Ball(RandomPoint(6, random), random.Uniform(1, 5), random.Uniform(0, .7), random));
  }
  return particles;
}

/// One or two layers along a wave, with holes.
SpaceParticles Sheet(Random& random) {
  SpaceParticles particles;
  const double slope = random.Uniform(0, 1), thickness = random.Chance(.5) ? 1 : 2;
  const double gap = random.Uniform(0, .3);
  for (double x = 0; x < 12; ++x) {
    for (double y = 0; y < 12; ++y) {
      if (random.Chance(gap)) continue;
      for (double layer = 0; layer < thickness; ++layer) {
        particles.Add(Vec3{x, y, slope * (x - y) + layer} + Shake(.2, random));
      }
    }
  }
  return particles;
}

SpaceParticles Drops(Random& random) {
  SpaceParticles particles;
  for (std::size_t k = random.Below(12) + 1; k > 0; --k) {
    const Vec3 centre = RandomPoint(12, random);
    for (std::size_t p = random.Below(6) + 1; p > 0; --p) {
      particles.Add(centre + Shake(1.2, random));
    }
  }
  return particles;
}

SpaceParticles Noise(Random& random) {
  SpaceParticles particles;
  const double extent = random.Uniform(2, 7);
  for (std::size_t k = random.Below(400); k > 0; --k) particles.Add(RandomPoint(extent, random));
  return particles;
}

/// Lattices, lines, planes and points at nodes, halves and on top of each other.
SpaceParticles Degenerate(Random& random) {
  SpaceParticles particles;
  const double step = random.Chance(.5) ? 1 : .5;
  const std::size_t kind = random.Below(4);
  const int count = static_cast<int>(random.Below(7)) + 1;
  for (int x = 0; x < count; ++x) {
    for (int y = 0; y < (kind > 0 ? count : 1); ++y) {
      for (int z = 0; z < (kind > 1 ? count : 1); ++z) {
        if (kind == 3 && random.Chance(.3)) continue;
        particles.Add(step * Vec3{1.0 * x, 1.0 * y, 1.0 * z});
        if (random.Chance(.05)) particles.Add(step * Vec3{1.0 * x, 1.0 * y, 1.0 * z});
      }
    }
  }
  return particles;
}

/// A ball with a cavity, in which there may be a drop.
SpaceParticles Hollow(Random& random) {
  const double outer = random.Uniform(6, 7.5), inner = random.Uniform(3, 4.5);
  SpaceParticles particles = Lattice({-9, -9, -9}, {9, 9, 9}, .2, random, [&](const Vec3& at) {
    return Length(at) <= outer && Length(at) >= inner;
  });
  if (random.Chance(.5)) particles.Add(Ball({0, 0, 0}, .5, 0, random));
  return particles;
}

void Round(SpaceParticles& particles) {
  for (double& value : particles.xyz) value = static_cast<double>(static_cast<float>(value));
}

}  // namespace

Frame SpaceParticles::AsFrame() const {
  Frame frame;
  frame.positions = std::span<const double>(xyz);
  frame.components = 3;
  frame.volumes = volumes;
  return frame;
}

SpaceParticles Ball(const Vec3& centre, double radius, double shake, Random& random) {
  const Vec3 reach{radius, radius, radius};
  return Lattice(centre - reach, centre + reach, shake, random,
                 [&](const Vec3& at) { return Length(at - centre) <= radius; });
}

SpaceParticles Box(const Vec3& low, const Vec3& high, double shake, Random& random) {
  return Lattice(low, high, shake, random, [](const Vec3&) { return true; });
}

SpaceParticles RandomSpaceScene(std::uint64_t seed) {
  Random random(seed);
  SpaceParticles particles;
  for (std::size_t scenes = random.Chance(.2) ? 2 : 1; scenes > 0; --scenes) {
    switch (random.Below(6)) {
      case 0:
        particles.Add(Blobs(random));
        break;
      case 1:
        particles.Add(Sheet(random));
        break;
      case 2:
        particles.Add(Drops(random));
        break;
      case 3:
        particles.Add(Noise(random));
        break;
      case 4:
        particles.Add(Degenerate(random));
        break;
      default:
        particles.Add(random.Chance(.3) ? Hollow(random) : Drops(random));
        break;
    }
  }
  if (random.Chance(.3)) {
    const Vec3 shift = RandomPoint(random.Chance(.3) ? 1e6 : 100, random);
    for (std::size_t k = 0; k < particles.size(); ++k) {
      particles.xyz[3 * k] += shift.x;
      particles.xyz[3 * k + 1] += shift.y;
      particles.xyz[3 * k + 2] += shift.z;
    }
    if (random.Chance(.5)) Round(particles);
  }
  if (random.Chance(.2)) {
    for (std::size_t k = 0; k < particles.size(); ++k) {
      particles.volumes.push_back(static_cast<float>(random.Uniform(.3, 2)));
    }
  }
  return particles;
}

SpaceParticles Shuffled(const SpaceParticles& particles, Random& random) {
  std::vector<std::size_t> order(particles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random.Below(k)]);
  SpaceParticles shuffled;
  for (const std::size_t k : order) {
    shuffled.Add(particles.At(k));
    if (!particles.volumes.empty()) shuffled.volumes.push_back(particles.volumes[k]);
  }
  return shuffled;
}

}  // namespace partiemc::support
