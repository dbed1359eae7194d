#include "space/sized_bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace partiemc::support {
namespace {

using support::Random;

// Steps of the relaxation, and steps between searches of neighbours.
constexpr int kSteps = 160, kStepsOfSearch = 10;
// Particles repel each other up to this many mean sizes.
constexpr double kRange = 1.6;

struct Packing {
  std::vector<Vec3> at;
  std::vector<double> size;
  std::vector<std::pair<std::size_t, std::size_t>> near;

  void FindNear() {
    near.clear();
    // By x, so that only few pairs are compared.
    std::vector<std::size_t> order(at.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::ranges::sort(order, {}, [&](std::size_t k) { return at[k].x; });
    const double largest = *std::ranges::max_element(size);
    for (std::size_t m = 0; m < order.size(); ++m) {
      const std::size_t a = order[m];
      for (std::size_t n = m + 1; n < order.size(); ++n) {
        const std::size_t b = order[n];
        if (at[b].x - at[a].x > 1.25 * kRange * (size[a] + largest) / 2) break;
        const double reach = 1.25 * kRange * (size[a] + size[b]) / 2;
        const Vec3 to = at[b] - at[a];
        if (Dot(to, to) < reach * reach) near.emplace_back(a, b);
      }
    }
  }
};

// The push of a particle at a distance of `apart` mean sizes; 0 beyond the range.
double PushAt(double apart) {
  const double within = 1 - apart / kRange;
  return within > 0 ? within * within : 0;
}

Vec3 OutwardFrom(const ExactShape& shape, const Vec3& at) {
  constexpr double kStep = 1e-4;
  const auto along = [&](const Vec3& by) {
    return shape.Distance(at + by) - shape.Distance(at - by);
  };
  const Vec3 gradient =
      Normalised({along({kStep, 0, 0}), along({0, kStep, 0}), along({0, 0, kStep})});
  return gradient == Vec3{} ? Vec3{1, 0, 0} : gradient;
}

// Moves every particle by the pushes of its neighbours and of its mirror image.
void Relax(const ExactShape& shape, double step, Packing& packing) {
  std::vector<Vec3> push(packing.at.size());
  for (const auto& [a, b] : packing.near) {
    const Vec3 to = packing.at[a] - packing.at[b];
    const double distance = std::max(Length(to), 1e-9);
    const double force = PushAt(2 * distance / (packing.size[a] + packing.size[b])) / distance;
    push[a] = push[a] + packing.size[b] * force * to;
    push[b] = push[b] - packing.size[a] * force * to;
  }
  for (std::size_t a = 0; a < packing.at.size(); ++a) {
    Vec3& at = packing.at[a];
    const double size = packing.size[a], depth = -shape.Distance(at);
    if (depth < kRange * size) {
      push[a] = push[a] - size * PushAt(std::max(2 * depth, 0.0) / size) * OutwardFrom(shape, at);
    }
    const double length = Length(push[a]), most = .2 * size;
    at = at + (length * step > most ? most / length : step) * push[a];
    const double outside = shape.Distance(at) + .05 * size;
    if (outside > 0) at = at - outside * OutwardFrom(shape, at);
  }
}

double LocalSize(const SpaceParticles& particles, const std::vector<double>& sizes,
                 const Vec3& at) {
  double sum = 0, weights = 0;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const Vec3 to = particles.At(k) - at;
    const double square = Dot(to, to), size = sizes[k];
    if (square >= 9 * size * size) continue;
    const double weight = std::pow(1 - square / (9 * size * size), 3);
    sum += weight * size;
    weights += weight;
  }
  return weights > 0 ? sum / weights : 1;
}

}  // namespace

SpaceParticles FillSized(const ExactShape& shape, Random& random, const DrawSize& draw) {
  Packing packing;
  const double reach = shape.Reach();
  for (double left = shape.Volume(); left > 0;) {
    const double x = random.Uniform(-reach, reach), y = random.Uniform(-reach, reach);
    const Vec3 at = shape.centre + Vec3{x, y, random.Uniform(-reach, reach)};
    if (shape.Distance(at) > 0) continue;
    const double size = draw(random, at);
    if (size == 0) continue;
    packing.at.push_back(at);
    packing.size.push_back(size);
    left -= size * size * size;
  }
  for (int step = 0; step < kSteps; ++step) {
    if (step % kStepsOfSearch == 0) packing.FindNear();
    Relax(shape, step < kSteps / 2 ? .2 : .1, packing);
  }
  SpaceParticles particles;
  for (std::size_t k = 0; k < packing.at.size(); ++k) {
    particles.Add(packing.at[k]);
    particles.volumes.push_back(static_cast<float>(std::pow(packing.size[k], 3)));
  }
  return particles;
}

SpaceParticles RandomSizedScene(std::uint64_t seed, double ratio) {
  Random random(seed);
  SpaceParticles particles = RandomSpaceScene(seed);
  particles.volumes.clear();
  const double low = 1 / std::sqrt(ratio);
  const bool is_bidisperse = random.Chance(.3);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double power = is_bidisperse ? std::floor(random.Uniform(0, 2)) : random.Unit();
    particles.volumes.push_back(static_cast<float>(std::pow(low * std::pow(ratio, power), 3)));
  }
  return particles;
}

SpaceParticles Shaken(SpaceParticles particles, Random& random, double noise) {
  for (std::size_t k = 0; k < particles.xyz.size(); ++k) {
    const double range = noise * std::cbrt(double{particles.volumes[k / 3]}) * std::numbers::sqrt3;
    particles.xyz[k] += random.Uniform(-range, range);
  }
  return particles;
}

SpaceParticles MovedBy(SpaceParticles particles, const Vec3& by) {
  for (std::size_t k = 0; k < particles.xyz.size(); ++k) {
    particles.xyz[k] += std::array{by.x, by.y, by.z}[k % 3];
  }
  return particles;
}

void AddSized(SpaceParticles& scene, const SpaceParticles& others) {
  scene.Add(others);
  scene.volumes.insert(scene.volumes.end(), others.volumes.begin(), others.volumes.end());
}

double SumOfVolumes(const SpaceParticles& particles) {
  double sum = 0;
  for (const float volume : particles.volumes) sum += volume;
  return sum;
}

void DrawSizes(SpaceParticles& particles, double low, double high, Random& random) {
  particles.volumes.clear();
  for (std::size_t k = 0; k < particles.size(); ++k) {
    particles.volumes.push_back(static_cast<float>(std::pow(random.Uniform(low, high), 3)));
  }
  const auto scale =
      static_cast<float>(static_cast<double>(particles.size()) / SumOfVolumes(particles));
  for (float& volume : particles.volumes) volume *= scale;
}

double MeanSpacing(const SpaceParticles& particles) {
  double volume = 0;
  for (const float of : particles.volumes) volume += of;
  return std::cbrt(volume / static_cast<double>(particles.size()));
}

double SizedDeviation(const Surface& surface, const ExactShape& shape,
                      const SpaceParticles& particles) {
  double sum = 0, area = 0;
  std::vector<double> sizes;
  for (const float volume : particles.volumes) sizes.push_back(std::cbrt(double{volume}));
  for (std::size_t t = 0; t < surface.TriangleCount(); ++t) {
    std::array<Vec3, 3> at;
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = Vec3At(surface.points, surface.triangles[3 * t + k]);
    }
    const double size = Length(Cross(at[1] - at[0], at[2] - at[0])) / 2;
    const Vec3 centre = (1.0 / 3) * (at[0] + at[1] + at[2]);
    double distance = 0;
    for (const Vec3& corner : at) distance += std::abs(shape.Distance(.5 * (corner + centre))) / 3;
    sum += size * distance / LocalSize(particles, sizes, centre);
    area += size;
  }
  return area > 0 ? sum / area : 1e300;
}

}  // namespace partiemc::support
