// Errors of surfaces of exact shapes, in relation to marching cubes on the same particles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "partiemc/surface_reconstructor.h"
#include "space/exact_shapes.h"
#include "space/space_particles.h"

namespace partiemc {
namespace {

using support::ErrorOf;
using support::ExactShape;
using support::Fill;
using support::Random;
using support::Sampler;
using support::SpaceParticles;
using support::SurfaceError;

enum class Kind { kSphere, kTorus, kBox };

std::unique_ptr<ExactShape> Make(Kind kind, Random& random) {
  const double x = random.Uniform(-1, 1), y = random.Uniform(-1, 1);
  const Vec3 centre{x, y, random.Uniform(-1, 1)};
  switch (kind) {
    case Kind::kSphere:
      return support::MakeSphere(centre, random.Uniform(5, 11));
    case Kind::kTorus: {
      const double large = random.Uniform(8, 11), small = random.Uniform(3, 4.5);
      return support::MakeTorus(centre, Normalised({x, y, 1}), large, small);
    }
    case Kind::kBox:
      break;
  }
  const double a = random.Uniform(4, 8), b = random.Uniform(4, 8);
  return support::MakeBox(centre, {a, b, random.Uniform(4, 8)}, random);
}

SurfaceError Measure(SurfacePlacement placement, const ExactShape& shape,
                     const SpaceParticles& particles) {
  const auto reconstructor = SurfaceReconstructor::Create({.placement = placement});
  SurfaceWorkspace workspace;
  Surface surface;
  EXPECT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).ok());
  const absl::Status status = Validate(surface);
  EXPECT_TRUE(status.ok()) << status.message();
  Random random(7);
  return ErrorOf(surface, shape, particles.size(), random);
}

/// The geometric mean and the largest of ratios.
struct Ratios {
  double log_sum = 0, worst = 0;
  int count = 0;

  void Add(double ratio) {
    log_sum += std::log(ratio);
    worst = std::max(worst, ratio);
    ++count;
  }
  double Mean() const { return std::exp(log_sum / count); }
};

/// Ratios to marching cubes.
struct Comparison {
  Ratios mean, hausdorff, normals;
  double volume = 0;  ///< Largest error.

  void Add(const SurfaceError& error, const SurfaceError& usual) {
    mean.Add(error.mean / usual.mean);
    hausdorff.Add(error.hausdorff / usual.hausdorff);
    normals.Add(error.normals / usual.normals);
    volume = std::max(volume, std::abs(error.volume));
  }
};

/// The seeds of a comparison: PARTIEMC_SPACE_SEEDS=first,count measures others.
std::pair<std::uint64_t, int> Seeds() {
  unsigned long first = 100;
  int count = 2;
  if (const char* const wanted = std::getenv("PARTIEMC_SPACE_SEEDS")) {
    std::sscanf(wanted, "%lu,%d", &first, &count);
  }
  return {first, count};
}

Comparison Compare(SurfacePlacement placement, Kind kind, Sampler sampler) {
  const auto [first, count] = Seeds();
  Comparison comparison;
  double usual_mean = 0;
  for (int k = 0; k < count; ++k) {
    Random random(first + k);
    const std::unique_ptr<ExactShape> shape = Make(kind, random);
    const SpaceParticles particles = Fill(*shape, sampler, random);
    const SurfaceError usual = Measure(SurfacePlacement::kMarchingCubes, *shape, particles);
    usual_mean += usual.mean / count;
    comparison.Add(Measure(placement, *shape, particles), usual);
  }
  const auto print = [](const char* name, const Ratios& ratios) {
    std::printf("  %s %.3f (worst %.3f)", name, ratios.Mean(), ratios.worst);
  };
  static constexpr std::array<const char*, 3> kKinds = {"sphere", "torus", "box"};
  static constexpr std::array<const char*, 3> kSamplers = {"lattice", "jittered", "relaxed"};
  std::printf("%-7s %-9s", kKinds[static_cast<int>(kind)], kSamplers[static_cast<int>(sampler)]);
  print("mean", comparison.mean);
  print("Hausdorff", comparison.hausdorff);
  print("normals", comparison.normals);
  std::printf("  volume %.4f; marching cubes: mean %.4f h\n", comparison.volume, usual_mean);
  return comparison;
}

constexpr std::array<Kind, 3> kKinds = {Kind::kSphere, Kind::kTorus, Kind::kBox};
constexpr std::array<Sampler, 3> kSamplers = {Sampler::kLattice, Sampler::kJittered,
                                              Sampler::kRelaxed};

/// The geometric means of a placement over kinds and samplers, and the largest volume error.
Comparison CompareAll(SurfacePlacement placement) {
  Comparison all;
  for (const Kind kind : kKinds) {
    for (const Sampler sampler : kSamplers) {
      const Comparison comparison = Compare(placement, kind, sampler);
      all.mean.Add(comparison.mean.Mean());
      all.hausdorff.Add(comparison.hausdorff.Mean());
      all.normals.Add(comparison.normals.Mean());
      all.volume = std::max(all.volume, comparison.volume);
    }
  }
  std::printf("all: mean %.3f  Hausdorff %.3f  normals %.3f\n", all.mean.Mean(),
              all.hausdorff.Mean(), all.normals.Mean());
  return all;
}

TEST(SpaceAccuracy, VirtualPlaneBeatsMarchingCubes) {
  const Comparison all = CompareAll(SurfacePlacement::kVirtualPlane);
  EXPECT_LT(all.mean.Mean(), .7);
  EXPECT_LT(all.hausdorff.Mean(), .9);
  EXPECT_LT(all.normals.Mean(), .65);
  EXPECT_LT(all.volume, .01);
}

TEST(SpaceAccuracy, QefIsBetweenThem) {
  EXPECT_LT(CompareAll(SurfacePlacement::kQef).mean.Mean(), 1.2);
}

}  // namespace
}  // namespace partiemc
