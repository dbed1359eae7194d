#include "spacing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/oracle.h"
#include "support/particles.h"

namespace partiemc {
namespace {

using support::Particles;

std::optional<double> Estimate(const Particles& particles) {
  SpacingScratch scratch;
  return EstimateSpacing(particles.AsFrame(), Plane::kXy, scratch);
}

TEST(Spacing, OfALatticeIsItsConstant) {
  EXPECT_EQ(Estimate(support::Lattice(20, 30)), 1.0);
  EXPECT_NEAR(*Estimate(support::Scaled(support::Lattice(20, 30), 0.0303)), 0.0303, 1e-12);
  EXPECT_EQ(Estimate(support::Lattice(50, 1)), 1.0);
}

TEST(Spacing, OfALatticeLargerThanTheSampleIsItsConstantToo) {
  EXPECT_EQ(Estimate(support::Lattice(300, 200)), 1.0);
}

TEST(Spacing, IsThatOfTheDensityHoweverTheParticlesAreArranged) {
  for (const double jitter : {0.1, 0.3, 0.5}) {
    support::Random random(11);
    Particles particles;
    for (int j = 0; j < 250; ++j) {
      for (int i = 0; i < 250; ++i) {
        particles.Add(i + random.Uniform(-jitter, jitter), j + random.Uniform(-jitter, jitter));
      }
    }
    EXPECT_NEAR(*Estimate(particles), 1, 0.01) << "jitter " << jitter;
  }
  support::Random random(12);
  EXPECT_NEAR(*Estimate(support::Noise(random, 40'000, 100)), 1, 0.03);
}

// Most neighbours of a thinned lattice are still at its constant.
TEST(Spacing, GrowsAsParticlesAreTakenAwayAtRandom) {
  for (const double kept : {0.8, 0.5, 0.3}) {
    support::Random random(13);
    Particles particles;
    for (int j = 0; j < 80; ++j) {
      for (int i = 0; i < 80; ++i) {
        if (random.Uniform(0, 1) < kept) particles.Add(i, j);
      }
    }
    const double expected = 80 / std::sqrt(static_cast<double>(particles.size()));
    EXPECT_NEAR(*Estimate(particles) / expected, 1, 0.03) << kept;
    EXPECT_LT(support::MedianNearestNeighbour(particles) / expected, 0.96) << kept;
  }
}

TEST(Spacing, WhereBodiesAreThinIsTheMedianDistanceToTheNearestNeighbour) {
  support::Random random(14);
  Particles film;
  for (int k = 0; k < 300; ++k) {
    film.Add(0.5 * k + random.Uniform(-0.2, 0.2), random.Uniform(-0.1, 0.1));
  }
  EXPECT_DOUBLE_EQ(*Estimate(film), support::MedianNearestNeighbour(film));
}

TEST(Spacing, IgnoresSprayAndLoneParticles) {
  support::Random random(12);
  const Particles body = support::Blob(random, 12);
  // Two fifths as many lone ones would shift the median of all.
  const int lone = static_cast<int>(body.size() * 2 / 5);
  const Particles spray =
      support::Shifted(support::Scaled(support::Lattice(lone, 1), 50), 100, 100);
  Particles particles = body;
  particles.Add(spray);
  EXPECT_NEAR(*Estimate(particles), *Estimate(body), 0.01);
  EXPECT_GT(support::MedianNearestNeighbour(particles), support::MedianNearestNeighbour(body));

  Particles film = support::Lattice(100, 1);
  film.Add(support::Shifted(support::Scaled(support::Lattice(40, 1), 50), 300, 100));
  EXPECT_EQ(Estimate(film), 1.0);
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

TEST(Spacing, DoesNotDependOnWhatWasEstimatedBefore) {
  support::Random random(14);
  SpacingScratch scratch;
  for (const auto& particles :
       {support::Lattice(300, 200), support::Lattice(2, 1), support::Noise(random, 5000, 40),
        Particles{}, support::Lattice(20, 30)}) {
    EXPECT_EQ(EstimateSpacing(particles.AsFrame(), Plane::kXy, scratch), Estimate(particles));
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
  SpacingScratch scratch;
  EXPECT_EQ(EstimateSpacing(frame, Plane::kXz, scratch), 2.0);
}

}  // namespace
}  // namespace partiemc
