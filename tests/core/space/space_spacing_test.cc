// The estimated spacing of particles in space.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <vector>

#include "partiemc/spacing.h"
#include "space/space_particles.h"

namespace partiemc {
namespace {

using support::Random;
using testing::SpaceParticles;

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
  ExpectNear(testing::Box(kLow, kHigh, 0, random), 1e-9, "lattice");
  ExpectNear(testing::Ball({.3, .2, .1}, 8, .1, random), .03, "ball, shaken by .1");
  ExpectNear(testing::Box(kLow, kHigh, .3, random), .03, "box, shaken by .3");
  ExpectNear(Darts(.7, random), .03, "darts .7 apart");
  ExpectNear(Darts(0, random), .06, "darts");
}

TEST(SpacingInSpace, OfThinSheetsIsTheDistanceToNeighbours) {
  Random random(4);
  ExpectNear(testing::Box({-20, -20, 0}, {20, 20, .5}, 0, random), 1e-9, "a layer");
  ExpectNear(testing::Box({-20, -20, 0}, {20, 20, 1.5}, .05, random), .1, "two layers");
}

TEST(SpacingInSpace, DoesNotDependOnOrderCopiesAndSpray) {
  Random random(5);
  SpaceParticles particles = testing::Box(kLow, kHigh, .2, random);
  const double alone = EstimateSpacing(particles.AsFrame()).value();
  EXPECT_EQ(EstimateSpacing(testing::Shuffled(particles, random).AsFrame()), alone);
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

TEST(SpacingInPlane, IsThatOfStreamsWithoutASpacing) {
  const std::vector<double> xy = {0, 0, 2, 0, 0, 2, 2, 2, std::nan(""), 7};
  EXPECT_EQ(EstimateSpacing({.positions = std::span<const double>(xy)}), 2.0);
}

}  // namespace
}  // namespace partiemc
