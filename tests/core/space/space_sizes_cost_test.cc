// Processor time of surfaces of particles with own sizes against equal particles. The test prints
// the table of core/SIZES.md, "Surfaces".
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "partiemc/surface_reconstructor.h"
#include "space/sized_bodies.h"
#include "space/space_particles.h"
#include "support/random.h"

namespace partiemc {
namespace {

using support::Random;
using support::SpaceParticles;

/// A ball of about `count` particles: cubes of the side `large` with one large particle, or with
/// small ones of the size 1. Positions are shaken by .2 sizes. `is_large(x)` chooses by the centre.
SpaceParticles BallOfCubes(int count, int large, double share, Random& random,
                           const std::function<bool(double x)>& is_large) {
  const double cube = std::pow(large, 3);
  const double volume = count * cube / (share + (1 - share) * cube);
  const double radius = std::cbrt(3 * volume / (4 * 3.14159265358979));
  SpaceParticles particles;
  const auto add = [&](const Vec3& at, double size) {
    if (Length(at) > radius - size / 2) return false;
    const double x = random.Uniform(-.2, .2), y = random.Uniform(-.2, .2);
    particles.Add(at + size * Vec3{x, y, random.Uniform(-.2, .2)});
    particles.volumes.push_back(static_cast<float>(size * size * size));
    return true;
  };
  const int cubes = static_cast<int>(radius / large) + 2;
  for (int k = -cubes; k < cubes; ++k) {
    for (int j = -cubes; j < cubes; ++j) {
      for (int i = -cubes; i < cubes; ++i) {
        const Vec3 low = static_cast<double>(large) * Vec3{1.0 * i, 1.0 * j, 1.0 * k};
        const Vec3 centre = low + (.5 * large) * Vec3{1, 1, 1};
        if (is_large(centre.x) && add(centre, large)) continue;
        for (int p = 0; p < large * large * large; ++p) {
          add(low + Vec3{p % large + .5, p / large % large + .5, p / large / large + .5}, 1);
        }
      }
    }
  }
  return particles;
}

struct CostCase {
  std::string_view name;
  SpaceParticles particles;
  Sizes sizes = Sizes::kOwn;
};

std::vector<CostCase> AllCases(int count) {
  Random random(7);
  const auto mixed = [&](int large, double share) {
    return BallOfCubes(count, large, share, random, [&](double) { return random.Chance(share); });
  };
  const auto zones = [&](int large) {
    return BallOfCubes(count, large, .5, random, [](double x) { return x < 0; });
  };
  std::vector<CostCase> cases = {{"equal, without the option", mixed(1, 1), Sizes::kEqual},
                                 {"equal, as own sizes", mixed(1, 1)},
                                 {"1:2, half the volume", mixed(2, .5)},
                                 {"1:3, half the volume", mixed(3, .5)},
                                 {"1:3, as many of each", mixed(3, 27.0 / 28)},
                                 {"2:1, two zones", zones(2)},
                                 {"3:1, two zones", zones(3)},
                                 // Sizes of 1 to 3 in the places of equal particles.
                                 {"1:3 uniform", mixed(1, 1)}};
  for (float& volume : cases.back().particles.volumes) {
    volume = static_cast<float>(std::pow(random.Uniform(1, 3), 3));
  }
  const double spread = support::MeanSpacing(cases.back().particles);
  for (double& value : cases.back().particles.xyz) value *= spread;
  return cases;
}

/// Nanoseconds of processor time per particle: the least of some frames in turns.
std::vector<double> Measure(SurfacePlacement placement, const std::vector<CostCase>& cases) {
  constexpr int kRounds = 3;
  std::vector<double> least(cases.size(), 1e300);
  std::vector<SurfaceWorkspace> workspaces(cases.size());
  for (int round = 0; round <= kRounds; ++round) {
    for (std::size_t k = 0; k < cases.size(); ++k) {
      const SpaceParticles& particles = cases[k].particles;
      const auto reconstructor =
          SurfaceReconstructor::Create({.placement = placement,
                                        .spacing = support::MeanSpacing(particles),
                                        .sizes = cases[k].sizes});
      Surface surface;
      const std::clock_t begin = std::clock();
      EXPECT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspaces[k], surface).ok());
      const double time = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
      // The first frame allocates.
      if (round == 0) continue;
      least[k] = std::min(least[k], 1e9 * time / static_cast<double>(particles.size()));
    }
  }
  return least;
}

// PARTIEMC_SPACE_PARTICLES sets the number of particles.
TEST(SpaceSizesCost, PerParticleIsAtMostTwiceThatOfEqualSizes) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const char* const wanted = std::getenv("PARTIEMC_SPACE_PARTICLES");
  const std::vector<CostCase> cases = AllCases(wanted == nullptr ? 10'000 : std::atoi(wanted));
  const std::vector<double> cubes = Measure(SurfacePlacement::kMarchingCubes, cases);
  const std::vector<double> planes = Measure(SurfacePlacement::kVirtualPlane, cases);
  std::printf("%-28s %9s %16s %24s\n", "", "particles", "marching-cubes", "virtual-plane");
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const std::string name(cases[k].name);
    std::printf("%-28s %9zu %8.0f ns %4.2f %16.0f ns %4.2f\n", name.c_str(),
                cases[k].particles.size(), cubes[k], cubes[k] / cubes[0], planes[k],
                planes[k] / planes[0]);
#ifndef PARTIEMC_SANITIZED
    EXPECT_LT(cubes[k], 2 * cubes[0]) << name;
    EXPECT_LT(planes[k], 2 * planes[0]) << name;
#endif
  }
}

}  // namespace
}  // namespace partiemc
