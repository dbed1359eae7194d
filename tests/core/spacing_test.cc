#include "spacing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/oracle.h"
#include "support/particles.h"

namespace partiemc {
namespace {

using support::Particles;

std::optional<double> Estimate(const Particles& particles) {
  return EstimateSpacing(particles.AsFrame(), Plane::kXy);
}

TEST(Spacing, OfALatticeIsItsConstant) {
  EXPECT_EQ(Estimate(support::Lattice(20, 30)), 1.0);
  EXPECT_NEAR(*Estimate(support::Scaled(support::Lattice(20, 30), 0.0303)), 0.0303, 1e-12);
  EXPECT_EQ(Estimate(support::Lattice(50, 1)), 1.0);
}

TEST(Spacing, OfALatticeLargerThanTheSampleIsItsConstantToo) {
  EXPECT_EQ(Estimate(support::Lattice(300, 200)), 1.0);
}

TEST(Spacing, IsTheMedianDistanceToTheNearestNeighbour) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    support::Random random(seed);
    const Particles particles = support::Blob(random, 12);
    // No particle is lone here, so that nothing is left out.
    EXPECT_DOUBLE_EQ(*Estimate(particles), support::MedianNearestNeighbour(particles));
  }
}

TEST(Spacing, OfALargeFrameIsWithinThreePercentOfTheMedianOfAll) {
  support::Random random(11);
  Particles particles;
  for (int j = 0; j < 250; ++j) {
    for (int i = 0; i < 250; ++i) {
      particles.Add(i + random.Uniform(-0.3, 0.3), j + random.Uniform(-0.3, 0.3));
    }
  }
  Particles part;  // The brute force is quadratic: the same distribution, a tenth of the particles.
  for (std::size_t k = 0; k < 6250; ++k) part.Add(particles.x(k), particles.y(k));
  EXPECT_NEAR(*Estimate(particles), support::MedianNearestNeighbour(part), 0.03);
}

TEST(Spacing, IgnoresSprayAndLoneParticles) {
  support::Random random(12);
  const Particles body = support::Blob(random, 12);
  Particles particles = body;
  // Two fifths as many lone ones would shift the median of all.
  const int lone = static_cast<int>(body.size() * 2 / 5);
  particles.Add(support::Shifted(support::Scaled(support::Lattice(lone, 1), 50), 100, 100));
  EXPECT_DOUBLE_EQ(*Estimate(particles), support::MedianNearestNeighbour(body));
  EXPECT_GT(support::MedianNearestNeighbour(particles), support::MedianNearestNeighbour(body));
}

TEST(Spacing, IgnoresDuplicates) {
  support::Random random(13);
  EXPECT_EQ(Estimate(support::WithDuplicates(support::Lattice(15, 15), random, 500)), 1.0);
}

TEST(Spacing, DoesNotDependOnTheOrderOfTheParticles) {
  for (const std::size_t count : {100, 40'000}) {
    support::Random random(14);
    const Particles particles = support::Noise(random, count, 100);
    const std::optional<double> expected = Estimate(particles);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(Estimate(support::Permuted(particles, random)), expected);
    }
  }
}

TEST(Spacing, OfTwoParticlesIsTheirDistance) {
  Particles particles;
  particles.Add(1, 2);
  particles.Add(4, 6);
  EXPECT_EQ(Estimate(particles), 5.0);
}

TEST(Spacing, NeedsTwoDistinctPositions) {
  EXPECT_EQ(Estimate({}), std::nullopt);
  EXPECT_EQ(Estimate(support::Lattice(1, 1, 3, 4)), std::nullopt);
  Particles equal;
  for (int k = 0; k < 10; ++k) equal.Add(3, 4);
  EXPECT_EQ(Estimate(equal), std::nullopt);
  equal.Add(3, 4.5);
  EXPECT_EQ(Estimate(equal), 0.5);
}

TEST(Spacing, ScalesWithThePositionsBitForBit) {
  support::Random random(15);
  const Particles particles = support::Blob(random, 8);
  for (const double factor : {0x1p-190, 0x1p-20, 0x1p20, 0x1p190}) {
    EXPECT_EQ(*Estimate(support::Scaled(particles, factor)), *Estimate(particles) * factor);
  }
}

TEST(Spacing, IsMeasuredInThePlaneOfTheParticles) {
  std::vector<double> xyz;
  for (int k = 0; k < 30; ++k) xyz.insert(xyz.end(), {2.0 * (k % 6), 7.0, 2.0 * (k / 6)});
  const Frame frame{.positions = std::span<const double>(xyz), .components = 3};
  EXPECT_EQ(EstimateSpacing(frame, Plane::kXz), 2.0);
}

}  // namespace
}  // namespace partiemc
