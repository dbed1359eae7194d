// The estimated spacing of particles in space, and doubts about the given one.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <vector>

#include "partiemc/doubt.h"
#include "partiemc/spacing.h"
#include "partiemc/surface_reconstructor.h"
#include "space/space_particles.h"

namespace partiemc {
namespace {

using support::Random;
using support::SpaceParticles;

constexpr Vec3 kLow{-5.5, -6.5, -6}, kHigh{6.5, 5.5, 6};

/// Darts in the box, of number density 1, that are at least `apart` from each other.
SpaceParticles Darts(double apart, Random& random) {
  SpaceParticles darts;
  const Vec3 size = kHigh - kLow;
  const auto count = static_cast<std::size_t>(size.x * size.y * size.z);
  while (darts.size() < count) {
    const double x = random.Unit(), y = random.Unit(), z = random.Unit();
    const Vec3 at = kLow + Vec3{size.x * x, size.y * y, size.z * z};
    bool is_free = true;
    for (std::size_t k = 0; k < darts.size() && is_free && apart > 0; ++k) {
      is_free = Length(darts.At(k) - at) >= apart;
    }
    if (is_free) darts.Add(at);
  }
  return darts;
}

void ExpectNear(const SpaceParticles& particles, double relative, const char* what) {
  for (const double scale : {1.0, 1e-3}) {
    SpaceParticles scaled;
    for (std::size_t k = 0; k < particles.size(); ++k) scaled.Add(scale * particles.At(k));
    const std::optional<double> spacing = EstimateSpacing(scaled.AsFrame());
    ASSERT_TRUE(spacing.has_value());
    if (scale == 1) std::printf("%s: %.4f\n", what, *spacing);
    EXPECT_NEAR(*spacing, scale, relative * scale) << what;
  }
}

TEST(SpacingInSpace, OfBodiesIsThatOfTheirDensity) {
  Random random(3);
  ExpectNear(support::Box(kLow, kHigh, 0, random), 1e-9, "lattice");
  ExpectNear(support::Ball({.3, .2, .1}, 8, .1, random), .03, "ball, shaken by .1");
  ExpectNear(support::Box(kLow, kHigh, .3, random), .03, "box, shaken by .3");
  ExpectNear(Darts(.7, random), .03, "darts .7 apart");
  ExpectNear(Darts(0, random), .06, "darts");
}

TEST(SpacingInSpace, OfThinSheetsIsTheDistanceToNeighbours) {
  Random random(4);
  ExpectNear(support::Box({-20, -20, 0}, {20, 20, .5}, 0, random), 1e-9, "a layer");
  ExpectNear(support::Box({-20, -20, 0}, {20, 20, 1.5}, .05, random), .1, "two layers");
}

TEST(SpacingInSpace, DoesNotDependOnOrderCopiesAndSpray) {
  Random random(5);
  SpaceParticles particles = support::Box(kLow, kHigh, .2, random);
  const double alone = EstimateSpacing(particles.AsFrame()).value();
  EXPECT_EQ(EstimateSpacing(support::Shuffled(particles, random).AsFrame()), alone);
  particles.Add(SpaceParticles(particles));
  EXPECT_EQ(EstimateSpacing(particles.AsFrame()), alone);
  for (int k = 0; k < 100; ++k) particles.Add(Vec3{100.0 + 20 * k, 0, 0});
  EXPECT_NEAR(EstimateSpacing(particles.AsFrame()).value(), alone, .01);
}

TEST(SpacingInSpace, IsAbsentIfNoTwoParticlesDiffer) {
  SpaceParticles particles;
  EXPECT_FALSE(EstimateSpacing(particles.AsFrame()).has_value());
  particles.Add(Vec3{1, 2, 3});
  particles.Add(Vec3{1, 2, 3});
  EXPECT_FALSE(EstimateSpacing(particles.AsFrame()).has_value());
  particles.Add(Vec3{1, 2, 5});
  particles.Add(Vec3{1, std::nan(""), 4});
  EXPECT_EQ(EstimateSpacing(particles.AsFrame()), 2.0);
}

Doubts DoubtsOf(const Frame& frame, const SurfaceParameters& parameters) {
  const auto reconstructor = SurfaceReconstructor::Create(parameters);
  SurfaceWorkspace workspace;
  Surface surface;
  EXPECT_TRUE(reconstructor->Reconstruct(frame, workspace, surface).ok());
  return surface.statistics.doubts;
}

bool Contradicts(const SpaceParticles& particles, double spacing, double cell_size = 1) {
  return DoubtsOf(particles.AsFrame(), {.spacing = spacing, .cell_size = cell_size})
      .Has(Doubt::kSpacingContradicted);
}

// The densest lattice, of number density 1.
SpaceParticles DensestBall(double radius) {
  SpaceParticles ball;
  const double half = std::cbrt(4) / 2;
  const int most = static_cast<int>(radius / half) + 1;
  for (int i = -most; i <= most; ++i) {
    for (int j = -most; j <= most; ++j) {
      for (int k = -most; k <= most; ++k) {
        const Vec3 at = half * Vec3{1.0 * i, 1.0 * j, 1.0 * k};
        if ((i + j + k) % 2 == 0 && Length(at) <= radius) ball.Add(at);
      }
    }
  }
  return ball;
}

TEST(SpacingDoubt, AFactorOfTwoOrMoreIsReportedInBodies) {
  Random random(6);
  const SpaceParticles bodies[] = {support::Box(kLow, kHigh, 0, random),
                                   support::Ball({.3, .2, .1}, 8, .2, random), DensestBall(8),
                                   Darts(.7, random)};
  for (const SpaceParticles& body : bodies) {
    for (const double factor : {2.0, 3.0, 8.0}) {
      EXPECT_TRUE(Contradicts(body, 1 / factor)) << factor;
      EXPECT_TRUE(Contradicts(body, factor)) << factor;
    }
    for (const double spacing : {.8, 1.0, 1.25}) EXPECT_FALSE(Contradicts(body, spacing));
    EXPECT_FALSE(Contradicts(body, 1, .5));
    EXPECT_TRUE(Contradicts(body, .5, .5));
    EXPECT_TRUE(Contradicts(support::Shuffled(body, random), .5));
  }
}

/// All particles are alone then, and most bricks are empty.
TEST(SpacingDoubt, ASpacingAHundredTimesTooSmallIsReported) {
  Random random(10);
  const SpaceParticles body = support::Box({-9, -9, -9}, {9, 9, 9}, .2, random);
  ASSERT_GT(body.size(), 5000u);
  EXPECT_TRUE(Contradicts(body, .01));
}

TEST(SpacingDoubt, SprayDropsThreadsAndFilmsGiveNone) {
  Random random(7);
  SpaceParticles spray, drops, threads;
  for (int k = 0; k < 400; ++k) {
    const double x = random.Unit(), y = random.Unit(), z = random.Unit();
    spray.Add(Vec3{30 * x, 30 * y, 30 * z});
  }
  for (int k = 0; k < 40; ++k) {
    const Vec3 at{8.0 * (k % 5), 8.0 * (k / 5 % 4), 8.0 * (k / 20)};
    drops.Add(support::Ball(at, 1.3, .1, random));
    threads.Add(support::Box(at, at + Vec3{30, .5, .5}, .1, random));
  }
  for (const double spacing : {.5, 1.0, 2.0}) EXPECT_FALSE(Contradicts(spray, spacing));
  EXPECT_FALSE(Contradicts(drops, 1));
  EXPECT_FALSE(Contradicts(threads, 1));
  for (const double height : {.5, 1.5, 2.5}) {
    EXPECT_FALSE(Contradicts(support::Box({-20, -20, 0}, {20, 20, height}, .1, random), 1));
  }
}

TEST(SpacingDoubt, OwnSizesCountInTheirOwnSpacings) {
  Random random(8);
  SpaceParticles mixed = support::Box(kLow, kHigh, 0, random);
  mixed.volumes.assign(mixed.size(), 1);
  const SpaceParticles coarse = support::Box(kLow, kHigh, 0, random);
  for (std::size_t k = 0; k < coarse.size(); ++k) {
    mixed.Add(3 * coarse.At(k) + Vec3{60, 0, 0});
    mixed.volumes.push_back(27);
  }
  const auto doubts_at = [&](double spacing) {
    return DoubtsOf(mixed.AsFrame(), {.spacing = spacing, .sizes = Sizes::kOwn});
  };
  EXPECT_FALSE(doubts_at(2).Has(Doubt::kSpacingContradicted));
  for (float& volume : mixed.volumes) volume *= 8;
  EXPECT_TRUE(doubts_at(2).Has(Doubt::kSpacingContradicted));
}

TEST(SurfaceDoubts, VolumesAndCoarsePositionsAreReported) {
  Random random(9);
  SpaceParticles body = support::Box(kLow, kHigh, 0, random);
  body.volumes.assign(body.size(), 1);
  EXPECT_TRUE(DoubtsOf(body.AsFrame(), {}).empty());
  for (float& volume : body.volumes) volume = 3;
  EXPECT_TRUE(DoubtsOf(body.AsFrame(), {}).Has(Doubt::kVolumesContradictSpacing));
  std::vector<float> far;
  for (const double coordinate : body.xyz) far.push_back(static_cast<float>(coordinate + 4e6));
  const Frame frame{.positions = std::span<const float>(far), .components = 3};
  EXPECT_TRUE(DoubtsOf(frame, {}).Has(Doubt::kPositionsCoarse));
}

TEST(SurfaceDoubts, WallPlanesBeforeMostParticlesAreReported) {
  Random random(9);
  const SpaceParticles body = support::Box(kLow, kHigh, 0, random);
  const auto doubted = [&](double height, bool is_fluid_above) {
    const WallPlane plane{.axis = 2, .position = height, .is_fluid_above = is_fluid_above};
    return DoubtsOf(body.AsFrame(), {.wall_planes = {plane}}).Has(Doubt::kWallsHideFluid);
  };
  const double middle = .5 * (kLow.z + kHigh.z);
  EXPECT_FALSE(doubted(middle, true));
  EXPECT_TRUE(doubted(middle + 4, true));
  EXPECT_TRUE(doubted(kHigh.z + 9, true));
  EXPECT_FALSE(doubted(middle, false));
  EXPECT_TRUE(doubted(middle - 4, false));
}

TEST(SpacingInPlane, IsThatOfStreamsWithoutASpacing) {
  const std::vector<double> xy = {0, 0, 2, 0, 0, 2, 2, 2, std::nan(""), 7};
  EXPECT_EQ(EstimateSpacing({.positions = std::span<const double>(xy)}), 2.0);
}

}  // namespace
}  // namespace partiemc
