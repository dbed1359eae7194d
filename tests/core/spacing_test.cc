#include "frame/spacing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "frame/neighbour_tree.h"
#include "support/oracle.h"
#include "support/particles.h"

namespace partiemc {
namespace {

using support::Particles;

std::optional<double> Estimate(const Particles& particles) {
  SpacingScratch scratch;
  const auto estimate = EstimateSpacing(particles.AsFrame(), Plane::kXy, scratch);
  if (!estimate) return std::nullopt;
  return estimate->spacing;
}

bool IsAgreed(const Particles& particles) {
  SpacingScratch scratch;
  const auto estimate = EstimateSpacing(particles.AsFrame(), Plane::kXy, scratch);
  return estimate && estimate->is_agreed;
}

// Rows shifted by half a spacing, as discs lie when they are pressed together.
Particles Hexagonal(int columns, int rows) {
  Particles particles;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) particles.Add(i + 0.5 * (j % 2), j * std::sqrt(0.75));
  }
  return particles;
}

// Two particles, this far from each other, for each that there was.
Particles InPairs(const Particles& particles, support::Random& random, double apart) {
  Particles pairs;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double angle = random.Uniform(0, 6.28);
    for (const double side : {-0.5, 0.5}) {
      pairs.Add(particles.xy[2 * k] + side * apart * std::cos(angle),
                particles.xy[2 * k + 1] + side * apart * std::sin(angle));
    }
  }
  return pairs;
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
  // Adding two fifths of lone particles would shift the median of all.
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
    const auto estimate = EstimateSpacing(particles.AsFrame(), Plane::kXy, scratch);
    EXPECT_EQ(estimate.has_value(), Estimate(particles).has_value());
    EXPECT_EQ(estimate ? estimate->spacing : 0, Estimate(particles).value_or(0));
  }
}

TEST(Spacing, IsAgreedWhereABodyIsHoweverItsParticlesAreArranged) {
  support::Random random(21);
  const Particles lattice = support::Lattice(40, 40);
  EXPECT_TRUE(IsAgreed(lattice));
  EXPECT_TRUE(IsAgreed(Hexagonal(40, 40)));
  for (const double most : {0.1, 0.3, 0.5}) {
    EXPECT_TRUE(IsAgreed(support::Jittered(lattice, random, most))) << most;
  }
  for (const double most : {0.1, 0.3}) {
    EXPECT_TRUE(IsAgreed(support::Jittered(Hexagonal(40, 40), random, most))) << most;
  }
  for (const double apart : {1e-6, 0.1, 0.4, 0.6}) {
    EXPECT_TRUE(IsAgreed(InPairs(support::Jittered(lattice, random, 0.05), random, apart)))
        << apart;
  }
  Particles thinned;
  for (std::size_t k = 0; k < lattice.size(); ++k) {
    if (random.Uniform(0, 1) < 0.5) thinned.Add(lattice.xy[2 * k], lattice.xy[2 * k + 1]);
  }
  EXPECT_TRUE(IsAgreed(thinned));
  // Small bodies beside the same number of spray particles.
  EXPECT_TRUE(IsAgreed(support::Disc(3)));
  EXPECT_TRUE(IsAgreed(support::Lattice(50, 4)));
  Particles with_spray = support::Lattice(20, 20);
  with_spray.Add(support::Shifted(support::Scaled(support::Lattice(40, 10), 30), 100, 100));
  EXPECT_TRUE(IsAgreed(with_spray));
}

TEST(Spacing, IsNotAgreedByFewOrRandomParticlesAndLines) {
  EXPECT_FALSE(IsAgreed(support::Lattice(2, 1)));
  EXPECT_FALSE(IsAgreed(support::Lattice(3, 3)));
  EXPECT_FALSE(IsAgreed(support::Lattice(500, 1)));
  EXPECT_FALSE(IsAgreed(support::Lattice(500, 2)));
  support::Random random(22);
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(IsAgreed(support::Noise(random, 10, 100))) << k;
  for (const std::size_t count : {1000, 10'000}) {
    EXPECT_FALSE(IsAgreed(support::Noise(random, count, 100))) << count;
  }
}

TEST(Spacing, OfParticlesInPairsIsThatOfTheDensity) {
  support::Random random(23);
  for (const double apart : {1e-6, 0.1, 0.4}) {
    const Particles pairs = InPairs(support::Lattice(40, 40), random, apart);
    EXPECT_NEAR(*Estimate(pairs), std::sqrt(0.5), 0.02) << apart;
  }
  // A few of them change nothing.
  Particles some = support::Lattice(30, 30);
  some.Add(support::Shifted(support::Lattice(30, 8), 1e-6, 0));
  EXPECT_NEAR(*Estimate(some), std::sqrt(30.0 / 38), 0.15);
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

// Around the sampled particles of the clump, sums have thousands of terms.
TEST(Spacing, OfALatticeBesideADenseClumpIsItsConstant) {
  support::Random random(24);
  Particles particles = support::Lattice(210, 210);
  particles.Add(support::Shifted(support::Noise(random, 5200, 1e-3), 40.3, 30.6));
  EXPECT_EQ(Estimate(particles), 1.0);
}

// The median distance is that of the spray, so the first sums in the body have thousands of terms.
TEST(Spacing, OfABodyWithMoreSprayThanParticlesIsThatOfTheBody) {
  Particles particles = support::Lattice(130, 130);
  particles.Add(support::Shifted(support::Scaled(support::Lattice(18'000, 1), 13), 0, -200));
  EXPECT_NEAR(*Estimate(particles), 1, 0.01);
}

TEST(NeighbourTree, GroupsStandForAllPositionsAround) {
  support::Random random(25);
  const Particles noise = support::Noise(random, 5000, 10);
  std::vector<Point> positions;
  for (std::size_t k = 0; k < noise.size(); ++k) positions.push_back({noise.x(k), noise.y(k)});
  BuildTree(std::span(positions));
  const std::span<const Point> tree = positions;
  const Point point{3, 4};
  for (const double radius : {0.5, 2.0, 20.0}) {
    std::size_t around = 0;
    for (const Point& at : tree) around += LongestOf(Difference(at, point)) <= radius;
    for (const std::size_t group : {1, 8, 64, 8192}) {
      std::size_t visits = 0, sum = 0;
      const auto visit = [&](const Point& offset, std::size_t count) {
        EXPECT_LE(LongestOf(offset), radius);
        EXPECT_LE(count, group);
        ++visits;
        sum += count;
        return true;
      };
      EXPECT_TRUE(VisitAround(tree, point, radius, group, visit));
      if (group == 1 || radius == 20.0) {
        EXPECT_EQ(sum, around) << radius << ' ' << group;
      }
      if (group == 1) {
        EXPECT_EQ(visits, around) << radius;
      }
      if (radius == 20.0) {
        EXPECT_LE(visits * group, 4 * around + group) << group;
      }
    }
  }
  std::size_t visits = 0;
  const auto stop = [&](const Point&, std::size_t) { return ++visits < 10; };
  EXPECT_FALSE(VisitAround(tree, point, 20, 1, stop));
  EXPECT_EQ(visits, 10u);
}

TEST(Spacing, IsMeasuredInThePlaneOfTheParticles) {
  std::vector<double> xyz;
  for (int k = 0; k < 30; ++k) xyz.insert(xyz.end(), {2.0 * (k % 6), 7.0, 2.0 * (k / 6)});
  const Frame frame{.positions = std::span<const double>(xyz), .components = 3};
  SpacingScratch scratch;
  EXPECT_EQ(EstimateSpacing(frame, Plane::kXz, scratch)->spacing, 2.0);
}

}  // namespace
}  // namespace partiemc
