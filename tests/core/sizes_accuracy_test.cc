// How far outlines are from known boundaries, for particles of different sizes. The test prints the
// table of core/SIZES.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "partiemc/partiemc.h"
#include "support/particles.h"
#include "support/reconstruct.h"
#include "support/sized_scenes.h"

namespace partiemc {
namespace {

using support::Body;
using support::DrawSize;
using support::Particles;
using support::Random;

struct Sampling {
  std::string_view name;
  DrawSize draw;
  double most_at_rest, most_with_noise;  // Bounds of the mean deviation, in local sizes.
  bool is_mixed = true;                  // Sizes differ.
};

constexpr std::uint64_t kSeed = 1;
constexpr double kNoise = .15;

std::vector<Sampling> AllSamplings() {
  const auto of_two = [](double size, double share) {
    return [=](Random& random, double, double) { return random.Chance(share) ? size : 1.0; };
  };
  const auto uniform = [](double largest) {
    return [=](Random& random, double, double) { return random.Uniform(1, largest); };
  };
  // A zone of large particles, another one of small particles.
  const auto zones = [](Random& random, double x, double) {
    return x > 0 ? 1.0 : random.Chance(.25) ? 2.0 : 0;
  };
  return {{"equal", of_two(1, 0), .03, .1, false},       {"1:1.5", uniform(1.5), .03, .1},
          {"1:3 uniform", uniform(3), .04, .1},          {"1:3 bidisperse", of_two(3, .5), .04, .1},
          {"1:10 bidisperse", of_two(10, .01), .15, .2}, {"2:1 zone", zones, .05, .1}};
}

// The bodies, for particles with this mean size.
std::array<Body, 3> BodiesFor(double size) {
  return {support::DiscBody(17 * size), support::SquareBody(15 * size, 4 * size),
          support::WavyBody(17 * size, 3, 2 * size)};
}

// The mean size of the particles around a point, weighted by their kernels.
double LocalSize(const Particles& particles, double x, double y) {
  double sum = 0, weights = 0;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double size = std::sqrt(double{particles.volumes[k]});
    const double square =
        (std::pow(particles.x(k) - x, 2) + std::pow(particles.y(k) - y, 2)) / (9 * size * size);
    if (square >= 1) continue;
    const double weight = std::pow(1 - square, 3);
    sum += weight * size;
    weights += weight;
  }
  return weights > 0 ? sum / weights : 1;
}

// The mean distance of the rings from the boundary in local sizes, over their length.
double DeviationOf(const Rings& rings, const Body& body, const Particles& particles) {
  double sum = 0, length = 0;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const auto points = rings.RingPoints(ring);
    const std::size_t count = points.size() / 2;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t next = (k + 1) % count;
      const double x = (points[2 * k] + points[2 * next]) / 2;
      const double y = (points[2 * k + 1] + points[2 * next + 1]) / 2;
      const double step =
          std::hypot(points[2 * next] - points[2 * k], points[2 * next + 1] - points[2 * k + 1]);
      sum += step * std::abs(body.distance(x, y)) / LocalSize(particles, x, y);
      length += step;
    }
  }
  return length > 0 ? sum / length : 1e300;
}

double MeanSize(const Sampling& sampling, std::uint64_t seed) {
  Random random(seed);
  double sum = 0;
  int count = 0;
  for (int k = 0; k < 10'000; ++k) {
    const double size = sampling.draw(random, k % 2 == 0 ? 1 : -1, 0);
    sum += size * size;
    count += size > 0;
  }
  return std::sqrt(sum / count);
}

// Mean deviations at rest and with noise.
struct Deviations {
  double rest = 0, shaken = 0;
};

double DeviationOf(const Particles& particles, const Body& body, Sizes sizes) {
  double volume = 0;
  for (const float of : particles.volumes) volume += of;
  const ReconstructionParameters parameters{
      .spacing = std::sqrt(volume / static_cast<double>(particles.size())), .sizes = sizes};
  return DeviationOf(support::ReconstructOnce(parameters, particles).rings, body, particles);
}

TEST(SizesAccuracy, DeviationFromKnownBoundaries) {
  std::printf("%-16s %20s %20s\n", "", "equal sizes", "own sizes");
  for (const Sampling& sampling : AllSamplings()) {
    Deviations equal, own;
    const auto bodies = BodiesFor(MeanSize(sampling, kSeed));
    for (const Body& body : bodies) {
      Random random(kSeed);
      const Particles rest = support::Filled(body, random, sampling.draw);
      const Particles shaken = support::Shaken(rest, random, kNoise);
      equal.rest += DeviationOf(rest, body, Sizes::kEqual) / bodies.size();
      equal.shaken += DeviationOf(shaken, body, Sizes::kEqual) / bodies.size();
      own.rest += DeviationOf(rest, body, Sizes::kOwn) / bodies.size();
      own.shaken += DeviationOf(shaken, body, Sizes::kOwn) / bodies.size();
    }
    const std::string name(sampling.name);
    std::printf("%-16s %12.3f / %.3f %12.3f / %.3f\n", name.c_str(), equal.rest, equal.shaken,
                own.rest, own.shaken);
    EXPECT_LT(own.rest, sampling.most_at_rest) << name;
    EXPECT_LT(own.shaken, sampling.most_with_noise) << name;
    if (sampling.is_mixed) {
      EXPECT_LT(own.rest, equal.rest / 2) << name;
    }
  }
}

}  // namespace
}  // namespace partiemc
