// The field of particles with own sizes in space, against sums over all particles (core/SIZES.md,
// "Surfaces").
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "frame/calibration.h"
#include "frame/scale.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "space/bins.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/level_set.h"
#include "space/point_sampler.h"
#include "space/sized_bodies.h"
#include "space/space_particles.h"
#include "space/space_stages.h"

namespace partiemc::space {
namespace {

using support::Random;
using support::RandomSizedScene;
using support::RandomSpaceScene;
using support::Shuffled;
using support::SpaceParticles;
using support::SpaceStages;

/// Resolved parameters in the form of the stages, for h = 1.
ReconstructionParameters ParametersFor(double kernel_radius, double cell_size) {
  ReconstructionParameters parameters;
  parameters.kernel_radius = kernel_radius;
  parameters.cell_size = cell_size;
  parameters.reference_radius = CalibratedSurfaceRadius(kernel_radius);
  parameters.slice = SlicePlane{};
  parameters.sizes = Sizes::kOwn;
  return parameters;
}

Scale ScaleOf(const SpaceParticles& particles, const ReconstructionParameters& parameters) {
  const auto [least, most] = std::ranges::minmax(particles.volumes);
  return MakeScale(parameters, 1, parameters.cell_size, 1,
                   {std::cbrt(double{least}), std::cbrt(double{most})});
}

// F by its equations (core/SIZES.md), as a sum over all particles in world units.
class SizedOracle {
 public:
  SizedOracle(const SpaceParticles& particles, const ReconstructionParameters& parameters)
      : particles_(particles),
        beta_(parameters.kernel_radius),
        alpha_(*parameters.reference_radius) {}

  struct At {
    double value = 0, size = 1;
    int term = 0;
    double kernel = 0;
  };

  At operator()(const Vec3& at) const {
    double sum = 0, sizes = 0;
    Vec3 first;
    Symmetric second;
    for (std::size_t p = 0; p < particles_.size(); ++p) {
      const double h = std::cbrt(double{particles_.volumes[p]});
      const Vec3 to = (1 / h) * (particles_.At(p) - at);
      const double square = Dot(to, to) / (beta_ * beta_);
      if (square >= 1) continue;
      const double k = std::pow(1 - square, 3);
      sum += k;
      sizes += k * h;
      first = first + k * to;
      second.xx += k * to.x * to.x;
      second.xy += k * to.x * to.y;
      second.xz += k * to.x * to.z;
      second.yy += k * to.y * to.y;
      second.yz += k * to.y * to.z;
      second.zz += k * to.z * to.z;
    }
    const double lone = 315 / (64 * std::numbers::pi * std::pow(beta_, 3));
    const double f = lone * sum, f0 = std::min(.9 / (beta_ * beta_), .7 * lone);
    const double slope = beta_ * 256 / 315, guard = (f0 - f) * slope;
    if (sum == 0) return {std::max(beta_ - alpha_, guard)};
    const double spread = LargestEigenvalue(second) / (beta_ * beta_ * sum);
    const double limit = std::max(.21, 2.4 * alpha_ * alpha_ / (beta_ * beta_));
    const std::array terms{Length(first) / sum - alpha_, guard, (spread - limit) * beta_ / .45};
    const auto largest = std::ranges::max_element(terms);
    At result{*largest, sizes / sum, static_cast<int>(largest - terms.begin()), sum};
    if ((.85 - f) * slope < result.value) {
      result.value = (.85 - f) * slope;
      result.term = 3;
    }
    result.value *= result.size;
    return result;
  }

 private:
  const SpaceParticles& particles_;
  double beta_, alpha_;
};

void ExpectFieldAgrees(const SpaceParticles& particles, double ratio, double kernel_radius,
                       double cell_size, int& exact, int& inside) {
  const ReconstructionParameters parameters = ParametersFor(kernel_radius, cell_size);
  const Scale scale = ScaleOf(particles, parameters);
  const SpaceStages stages(particles, scale);
  const SizedOracle oracle(particles, parameters);
  Random random(particles.size());
  for (int k = 0; k < 400; ++k) {
    BrickPlace place{static_cast<std::uint32_t>(random.Below(stages.bins.bricks.size())),
                     static_cast<int>(random.Below(8)), static_cast<int>(random.Below(8)),
                     static_cast<int>(random.Below(8))};
    const auto& cells = stages.crossings.cells;
    if (random.Chance(.7) && !cells.empty()) {
      const ActiveCell& cell = cells[random.Below(cells.size())];
      place = {cell.brick, cell.i, cell.j, cell.k};
    }
    const Vec3 at = OriginOf(stages.bins.bricks[place.brick]) +
                    Vec3{1.0 * place.i, 1.0 * place.j, 1.0 * place.k};
    const SizedOracle::At expected = oracle(cell_size * at);
    inside += stages.field.IsInside(place);
    // A small density magnifies the rounding of positions, which small particles magnify, too.
    const double tolerance =
        2e-4 * std::sqrt(ratio) + 2e-5 / (1e-3 + expected.kernel) + 1e-5 * std::abs(expected.value);
    if (std::abs(expected.value) > tolerance) {
      ASSERT_EQ(stages.field.IsInside(place), expected.value < 0) << "F = " << expected.value;
    }
    if ((stages.field.exact[place.brick][place.k] >> place.Bit() & 1) == 0) continue;
    // At the end of the kernels, the mean depends on the rounding.
    if (expected.kernel < 1e-4) continue;
    ASSERT_NEAR(cell_size * stages.field.At(place), expected.value, tolerance);
    ++exact;
  }
}

TEST(SpaceSizesField, FieldAgreesWithSumsOverAllParticles) {
  int exact = 0, inside = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const double radius = random.Uniform(1.5, 4), cell = random.Uniform(.5, 2);
    const double ratio = std::array{1.0, 3.0, 10.0, 30.0}[seed % 4];
    SCOPED_TRACE(::testing::Message() << "seed " << seed << ", ratio " << ratio);
    const SpaceParticles particles = RandomSizedScene(seed, ratio);
    if (particles.size() > 0) {
      ExpectFieldAgrees(particles, ratio, radius, cell, exact, inside);
    }
  }
  EXPECT_GT(exact, 3'000);
  EXPECT_GT(inside, 1'000);
}

// More particles than a block, a part and a brick of NearRegionOf have room for.
TEST(SpaceSizesField, FieldOfDenseFramesAgrees) {
  int exact = 0, inside = 0;
  for (const int count : {900, 2'500, 6'000, 20'000}) {
    SCOPED_TRACE(count);
    Random random(static_cast<std::uint64_t>(count));
    SpaceParticles particles;
    for (int k = 0; k < count; ++k) {
      const double x = random.Uniform(1, 4), y = random.Uniform(1, 4);
      particles.Add({x, y, random.Uniform(1, 4)});
      particles.volumes.push_back(static_cast<float>(std::pow(random.Uniform(.3, 1.5), 3)));
    }
    ExpectFieldAgrees(particles, 5, 3, 1, exact, inside);
  }
  EXPECT_GT(exact, 300);
  EXPECT_GT(inside, 100);
}

TEST(SpaceSizesField, EqualSizesGiveTheFieldOfEqualSizes) {
  for (const std::uint64_t seed : {2u, 3u, 5u, 8u}) {
    SpaceParticles particles = RandomSpaceScene(seed);
    particles.volumes.assign(particles.size(), 1);
    ReconstructionParameters parameters = ParametersFor(3, 1);
    const SpaceStages own(particles, ScaleOf(particles, parameters));
    parameters.sizes = Sizes::kEqual;
    const SpaceStages equal(particles, MakeScale(parameters, 1, 1, 1));
    ASSERT_EQ(own.field.inside, equal.field.inside);
    ASSERT_EQ(own.field.exact, equal.field.exact);
    for (std::size_t brick = 0; brick < own.field.values.size(); ++brick) {
      for (int node = 0; node < kBrickNodes; ++node) {
        if ((own.field.exact[brick][node / 64] >> node % 64 & 1) == 0) continue;
        ASSERT_NEAR(own.field.values[brick][node], equal.field.values[brick][node], 1e-4);
      }
    }
  }
}

TEST(SpaceSizesField, BitsOfTheFieldDependNeitherOnOrderNorOnThreads) {
  Random random(4);
  for (const std::uint64_t seed : {11u, 12u, 13u, 14u}) {
    const SpaceParticles particles = RandomSizedScene(seed, 5);
    const Scale scale = ScaleOf(particles, ParametersFor(3, 1));
    const SpaceStages stages(particles, scale);
    for (const unsigned threads : {1u, 2u, 7u}) {
      const SpaceParticles shuffled = Shuffled(particles, random);
      Arena(threads).Execute([&] {
        const SpaceStages other(shuffled, scale);
        EXPECT_EQ(other.field.values, stages.field.values);
        EXPECT_EQ(other.field.inside, stages.field.inside);
        EXPECT_EQ(other.bins.x, stages.bins.x);
        EXPECT_EQ(other.bins.size, stages.bins.size);
      });
    }
  }
}

TEST(SpaceSizesField, GradientsAgreeWithDifferences) {
  Random random(5);
  int terms[4] = {};
  for (int trial = 0; trial < 600; ++trial) {
    SpaceParticles particles = support::Ball({0, 0, 0}, random.Uniform(2, 4), .3, random);
    if (trial % 4 == 0) {
      for (double& value : particles.xyz) value *= .8;
    }
    const double distance = random.Uniform(5, 9);
    for (std::size_t k = particles.size(); k-- > 0;) {
      particles.Add(particles.At(k) + Vec3{0, distance, 0});
    }
    for (std::size_t k = 0; k < particles.size(); ++k) {
      particles.volumes.push_back(static_cast<float>(std::pow(random.Uniform(.6, 1.6), 3)));
    }
    const ReconstructionParameters parameters = ParametersFor(3, 1);
    const Scale scale = ScaleOf(particles, parameters);
    SpaceBins bins;
    ASSERT_TRUE(BinParticles(particles.AsFrame(), scale, {}, bins).ok());
    const double x = random.Uniform(0, 2), y = random.Uniform(0, 7.5);
    const Vec3 at{x, y, random.Uniform(0, 2)};
    const SizedOracle oracle(particles, parameters);
    const SizedOracle::At level = oracle(at);
    constexpr double kStep = 1e-5;
    bool is_smooth = level.kernel > .05;
    // Without the local size, whose gradient is left out.
    const auto slope = [&](const Vec3& by) {
      const SizedOracle::At above = oracle(at + by), below = oracle(at - by);
      is_smooth = is_smooth && above.term == level.term && below.term == level.term;
      return level.size * (above.value / above.size - below.value / below.size) / (2 * kStep);
    };
    const Vec3 difference{slope({kStep, 0, 0}), slope({0, kStep, 0}), slope({0, 0, kStep})};
    if (!is_smooth) continue;
    ++terms[level.term];
    PointSampler sampler(bins, scale);
    sampler.MoveTo(bins.bricks.Find({0, 0, 0}), {{0, 0, 0}, {2, 7.5f, 2}});
    const PointSample sample = sampler.Sample(at);
    EXPECT_NEAR(sample.value, level.value, 1e-4);
    EXPECT_NEAR(sample.size, level.size, 1e-5);
    EXPECT_LT(Length(sample.gradient - difference), 2e-3 * (1 + Length(difference))) << level.term;
  }
  for (const int term : {0, 2, 3}) EXPECT_GT(terms[term], 5) << term;
}

}  // namespace
}  // namespace partiemc::space
