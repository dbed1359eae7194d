// Bins, field and point samples in space, against sums over all particles in double.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "frame/calibration.h"
#include "frame/scale.h"
#include "partiemc/arena.h"
#include "space/bins.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/level_set.h"
#include "space/point_sampler.h"
#include "space/space_particles.h"
#include "space/space_stages.h"
#include "support/tries.h"

namespace partiemc::space {
namespace {

using support::Ball;
using support::Random;
using support::RandomSpaceScene;
using support::Shuffled;
using support::SpaceParticles;
using support::SpaceStages;

Scale ScaleFor(double kernel_radius = 3, double cell_size = 1, double lightest = 1) {
  ReconstructionParameters parameters;
  parameters.kernel_radius = kernel_radius;
  parameters.reference_radius = CalibratedSliceRadius(kernel_radius);
  parameters.slice = SlicePlane{};
  return MakeScale(parameters, 1, cell_size, lightest);
}

/// Sums over all particles; `at` in cells.
Sums SumsAt(const SpaceParticles& particles, const Scale& scale, const Vec3& at) {
  Sums sums;
  const double inverse = 1 / (scale.kernel_radius * scale.kernel_radius);
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const Vec3 to = (1 / scale.cell_size) * particles.At(p) - at;
    const double t = 1 - Dot(to, to) * inverse;
    if (t <= 0) continue;
    const double k = t * t * t;
    sums.kernel += k;
    sums.density +=
        k * (particles.volumes.empty()
                 ? scale.uniform_weight
                 : particles.volumes[p] * scale.weight_per_volume / std::pow(scale.cell_size, 3));
    sums.first = sums.first + k * to;
    sums.second.xx += k * to.x * to.x;
    sums.second.xy += k * to.x * to.y;
    sums.second.xz += k * to.x * to.z;
    sums.second.yy += k * to.y * to.y;
    sums.second.yz += k * to.y * to.z;
    sums.second.zz += k * to.z * to.z;
  }
  return sums;
}

void ExpectField(const SpaceParticles& particles, const Scale& scale) {
  const SpaceStages stages(particles, scale);
  std::size_t inside = 0;
  for (std::uint32_t brick = 0; brick < stages.bins.bricks.size(); ++brick) {
    const Vec3 origin = OriginOf(stages.bins.bricks[brick]);
    for (int node = 0; node < kBrickNodes; ++node) {
      const BrickPlace place{brick, node % 8, node / 8 % 8, node / 64};
      const Vec3 at = origin + Vec3{1.0 * place.i, 1.0 * place.j, 1.0 * place.k};
      const Sums sums = SumsAt(particles, scale, at);
      const double expected = LevelSetOf(sums, scale).value;
      inside += stages.field.IsInside(place);
      if (std::abs(expected) > 2e-4) {
        ASSERT_EQ(stages.field.IsInside(place), expected < 0) << "F = " << expected;
      }
      if ((stages.field.exact[brick][place.k] >> place.Bit() & 1) != 0) {
        // A small density magnifies the rounding of positions.
        ASSERT_NEAR(stages.field.At(place), expected, 2e-4 + 1e-5 / (1e-3 + sums.kernel));
      }
    }
  }
  EXPECT_GT(inside, 0u);
}

TEST(SpaceField, AgreesWithSumsOverAllParticles) {
  Random random(1);
  ExpectField(Ball({.3, .1, -.2}, 4, .3, random), ScaleFor());
  for (const std::uint64_t seed : {2u, 3u, 5u, 8u}) {
    SpaceParticles particles = RandomSpaceScene(seed);
    particles.volumes.clear();
    ExpectField(particles, ScaleFor());
  }
}

TEST(SpaceField, AgreesForOtherRadiiAndCells) {
  Random random(2);
  const SpaceParticles ball = Ball({0, 0, 0}, 2.5, .2, random);
  ExpectField(ball, ScaleFor(1.5));
  ExpectField(ball, ScaleFor(3, .5));
  ExpectField(ball, ScaleFor(3, 2.3));
  ExpectField(ball, ScaleFor(4, .3));  // The kernel reaches over two bricks.
}

TEST(SpaceField, AgreesForVolumes) {
  Random random(3);
  SpaceParticles ball = Ball({0, 0, 0}, 3, .3, random);
  for (std::size_t k = 0; k < ball.size(); ++k) {
    ball.volumes.push_back(static_cast<float>(random.Uniform(.5, 1.5)));
  }
  ExpectField(ball, ScaleFor(3, 1, .5));
}

TEST(SpaceField, HasTheSameBitsForAnyOrderAndThreads) {
  Random random(4);
  for (const std::uint64_t seed : {11u, 12u, 13u, 14u}) {
    const SpaceParticles particles = RandomSpaceScene(seed);
    const SpaceStages stages(particles, ScaleFor());
    for (const unsigned threads : {1u, 2u, 7u}) {
      const SpaceParticles shuffled = Shuffled(particles, random);
      Arena(threads).Execute([&] {
        const SpaceStages other(shuffled, ScaleFor());
        EXPECT_EQ(other.field.values, stages.field.values);
        EXPECT_EQ(other.field.inside, stages.field.inside);
        EXPECT_EQ(other.bins.x, stages.bins.x);
      });
    }
  }
}

TEST(SpaceBins, SortWeightsAtOnePosition) {
  Random random(6);
  SpaceParticles particles;
  for (int k = 0; k < 300; ++k) {
    particles.Add({1.5 * (k % 6), .5, .25});
    particles.volumes.push_back(static_cast<float>(random.Uniform(.3, 2)));
  }
  const SpaceStages stages(particles, ScaleFor(3, 1, .3));
  const SpaceStages other(Shuffled(particles, random), ScaleFor(3, 1, .3));
  EXPECT_EQ(other.bins.weight, stages.bins.weight);
  EXPECT_EQ(other.field.values, stages.field.values);
}

TEST(SpaceBins, RefusesTooManyBricksAndFarPositions) {
  SpaceParticles particles;
  particles.Add({0, 0, 0});
  particles.Add({1e6, 0, 0});
  SpaceBins bins;
  EXPECT_EQ(BinParticles(particles.AsFrame(), ScaleFor(), {.max_tiles = 9}, bins).code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(BinParticles(particles.AsFrame(), ScaleFor(), {.max_tiles = 100}, bins).ok());
  particles.Add({0, 2e9, 0});
  EXPECT_EQ(BinParticles(particles.AsFrame(), ScaleFor(), {}, bins).code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(PointSampler, GradientsAgreeWithDifferences) {
  Random random(5);
  int terms[4] = {};
  for (int trial = 0; trial < 400; ++trial) {
    SpaceParticles particles = Ball({0, 0, 0}, random.Uniform(2, 4), .3, random);
    // Dense particles saturate.
    if (trial % 4 == 0) {
      for (double& value : particles.xyz) value *= .8;
    }
    // Two bodies have a gap between them.
    const double distance = random.Uniform(5, 9);
    for (std::size_t k = particles.size(); k-- > 0;) {
      particles.Add(particles.At(k) + Vec3{0, distance, 0});
    }
    const Scale scale = ScaleFor();
    SpaceBins bins;
    ASSERT_TRUE(BinParticles(particles.AsFrame(), scale, {}, bins).ok());
    const Vec3 at{random.Uniform(0, 2), random.Uniform(0, 7.5), random.Uniform(0, 2)};
    const auto value = [&](const Vec3& by) {
      return LevelSetOf(SumsAt(particles, scale, at + by), scale);
    };
    const LevelSetAt level = value({});
    constexpr double kStep = 1e-5;
    const Vec3 x{kStep, 0, 0}, y{0, kStep, 0}, z{0, 0, kStep};
    const bool is_smooth =
        value(x).term == level.term && value(y).term == level.term && value(z).term == level.term;
    if (!is_smooth || SumsAt(particles, scale, at).kernel < .05) continue;
    ++terms[static_cast<int>(level.term)];
    PointSampler sampler(bins, scale);
    const std::uint32_t brick = bins.bricks.Find({0, 0, 0});
    sampler.MoveTo(brick, {{0, 0, 0}, {2, 7.5f, 2}});
    const PointSample sample = sampler.Sample(at);
    EXPECT_NEAR(sample.value, level.value, 1e-4);
    const Vec3 difference{(value(x).value - value(-1 * x).value) / (2 * kStep),
                          (value(y).value - value(-1 * y).value) / (2 * kStep),
                          (value(z).value - value(-1 * z).value) / (2 * kStep)};
    EXPECT_LT(Length(sample.gradient - difference), 2e-3 * (1 + Length(difference)))
        << static_cast<int>(level.term);
  }
  // The guard, which has the slope of the saturation, hardly ever determines F.
  for (const Term term : {Term::kPhi, Term::kGap, Term::kSaturation}) {
    EXPECT_GT(terms[static_cast<int>(term)], 5) << static_cast<int>(term);
  }
}

TEST(LargestEigenvalue, AgreesWithPowerIteration) {
  Random random(6);
  for (int trial = 0; trial < support::Tries(2'000); ++trial) {
    // A sum of squares of random vectors, some of them parallel or in a plane.
    Symmetric a;
    const double flat = trial % 3 == 0 ? 1 : trial % 3 == 1 ? 1e-3 : 0;
    for (int k = 0; k < 4; ++k) {
      const Vec3 v{random.Uniform(-1, 1), flat * random.Uniform(-1, 1), random.Uniform(-1, 1)};
      a.xx += v.x * v.x;
      a.xy += v.x * v.y;
      a.xz += v.x * v.z;
      a.yy += v.y * v.y;
      a.yz += v.y * v.z;
      a.zz += v.z * v.z;
    }
    Vec3 v = Normalised({.3, .4, .5});
    for (int k = 0; k < 4'000; ++k) v = Normalised(a.Times(v));
    const double value = LargestEigenvalue(a);
    EXPECT_NEAR(value, Dot(v, a.Times(v)), 1e-6);
    const Vec3 of = Eigenvector(a, value);
    if (of == Vec3{}) continue;
    EXPECT_LT(Length(a.Times(of) - value * of), 1e-4);
  }
  EXPECT_DOUBLE_EQ(LargestEigenvalue({2, 0, 0, 2, 0, 2}), 2);
  EXPECT_NEAR(LargestEigenvalue({1, 0, 0, 2, 0, 3}), 3, 2e-8);
  EXPECT_NEAR(LargestEigenvalue({1, 0, 0, 3, 0, 3}), 3, 2e-8);
}

}  // namespace
}  // namespace partiemc::space
