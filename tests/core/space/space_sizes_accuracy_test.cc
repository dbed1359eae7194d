// How far surfaces are from known boundaries, for particles of different sizes. The test prints the
// table of core/SIZES.md, "Surfaces".
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "partiemc/surface_reconstructor.h"
#include "space/exact_shapes.h"
#include "space/sized_bodies.h"
#include "space/space_particles.h"

namespace partiemc {
namespace {

using support::DrawSize;
using support::ExactShape;
using support::Random;
using support::SpaceParticles;

struct Sampling {
  std::string_view name;
  DrawSize draw;
  double mean;                           // The cube root of the mean volume.
  double most_at_rest, most_with_noise;  // Bounds of the mean deviation, in local sizes.
  bool is_mixed = true;                  // Sizes differ.
};

constexpr double kNoise = .15;

std::vector<Sampling> AllSamplings() {
  const auto of_two = [](double size, double share) {
    return [=](Random& random, const Vec3&) { return random.Chance(share) ? size : 1.0; };
  };
  const auto uniform = [](double largest) {
    return [=](Random& random, const Vec3&) { return random.Uniform(1, largest); };
  };
  // A zone of large particles, another one of small particles.
  const auto zones = [](double size) {
    return [=](Random& random, const Vec3& at) {
      return at.x > 0 ? 1.0 : random.Chance(1 / (size * size * size)) ? size : 0;
    };
  };
  return {{"equal", of_two(1, 0), 1, .03, .1, false},
          {"1:1.5 uniform", uniform(1.5), 1.27, .03, .1},
          {"1:3 uniform", uniform(3), 2.15, .04, .1},
          {"1:3, as many of each", of_two(3, .5), 2.41, .04, .1},
          {"1:3, half the volume", of_two(3, 1.0 / 28), 1.25, .08, .1},
          {"2:1, two zones", zones(2), 1.21, .05, .1},
          {"3:1, two zones", zones(3), 1.25, .08, .1}};
}

std::uint64_t Seed() {
  const char* const wanted = std::getenv("PARTIEMC_SPACE_SEEDS");
  return wanted == nullptr ? 1 : std::strtoull(wanted, nullptr, 10);
}

// The bodies, for particles with this mean size.
std::vector<std::unique_ptr<ExactShape>> BodiesFor(double size, Random& random) {
  const double x = random.Uniform(-.5, .5), y = random.Uniform(-.5, .5);
  const Vec3 centre{x, y, random.Uniform(-.5, .5)};
  std::vector<std::unique_ptr<ExactShape>> bodies;
  bodies.push_back(support::MakeSphere(centre, 8 * size));
  bodies.push_back(support::MakeBox(centre, {8 * size, 6.5 * size, 5.5 * size}, random));
  bodies.push_back(support::MakeTorus(centre, Normalised({x, y, 1}), 8 * size, 3.5 * size));
  return bodies;
}

struct Outcome {
  double rest = 0, shaken = 0, volume = 0;
};

double Measure(SurfacePlacement placement, Sizes sizes, const ExactShape& shape,
               const SpaceParticles& particles, double& volume_error) {
  const auto reconstructor = SurfaceReconstructor::Create(
      {.placement = placement, .spacing = support::MeanSpacing(particles), .sizes = sizes});
  SurfaceWorkspace workspace;
  Surface surface;
  EXPECT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).ok());
  const absl::Status status = Validate(surface);
  EXPECT_TRUE(status.ok()) << status.message();
  double volume = 0, wanted = 0;
  for (const ShellMeasures& shell : surface.measures) volume += shell.volume;
  for (const float of : particles.volumes) wanted += of;
  volume_error = std::max(volume_error, std::abs(volume / wanted - 1));
  return SizedDeviation(surface, shape, particles);
}

TEST(SpaceSizesAccuracy, DeviationFromKnownBoundaries) {
  std::printf("%-22s %15s %15s %15s %15s %8s\n", "", "cubes, equal", "cubes, own", "planes, equal",
              "planes, own", "volume");
  for (const Sampling& sampling : AllSamplings()) {
    Random random(Seed());
    std::array<Outcome, 4> outcomes;
    const auto bodies = BodiesFor(sampling.mean, random);
    for (const auto& body : bodies) {
      const SpaceParticles rest = support::FillSized(*body, random, sampling.draw);
      const SpaceParticles shaken = support::Shaken(rest, random, kNoise);
      for (std::size_t k = 0; k < outcomes.size(); ++k) {
        const auto placement =
            k < 2 ? SurfacePlacement::kMarchingCubes : SurfacePlacement::kVirtualPlane;
        const Sizes sizes = k % 2 == 0 ? Sizes::kEqual : Sizes::kOwn;
        Outcome& of = outcomes[k];
        const double share = 1.0 / static_cast<double>(bodies.size());
        of.rest += share * Measure(placement, sizes, *body, rest, of.volume);
        of.shaken += share * Measure(placement, sizes, *body, shaken, of.volume);
      }
    }
    const std::string name(sampling.name);
    std::printf("%-22s", name.c_str());
    for (const Outcome& of : outcomes) std::printf("    %.3f / %.3f", of.rest, of.shaken);
    std::printf("  %.4f\n", outcomes[3].volume);
    EXPECT_LT(outcomes[3].rest, sampling.most_at_rest) << name;
    EXPECT_LT(outcomes[3].shaken, sampling.most_with_noise) << name;
    EXPECT_LT(outcomes[3].volume, .005) << name;
    if (sampling.is_mixed) {
      EXPECT_LT(outcomes[3].rest, outcomes[2].rest) << name;
    }
  }
}

}  // namespace
}  // namespace partiemc
