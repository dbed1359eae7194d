// Surfaces of particles with own sizes: the field against sums over all particles, guarantees,
// volumes, refusals (core/SIZES.md, "Surfaces").
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "frame/calibration.h"
#include "frame/scale.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "space/bins.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/level_set.h"
#include "space/point_sampler.h"
#include "space/space_particles.h"
#include "support/instruction_sets.h"
#include "support/tries.h"

namespace partiemc::space {
namespace {

using support::Random;
using testing::RandomSpaceScene;
using testing::Shuffled;
using testing::SpaceParticles;

/// A random scene whose sizes are within a factor of `ratio` of each other.
SpaceParticles RandomSizes(std::uint64_t seed, double ratio) {
  Random random(seed);
  SpaceParticles particles = RandomSpaceScene(seed);
  particles.volumes.clear();
  const double low = 1 / std::sqrt(ratio);
  const bool is_bidisperse = random.Chance(.3);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double power = is_bidisperse ? std::floor(random.Uniform(0, 2)) : random.Unit();
    particles.volumes.push_back(static_cast<float>(std::pow(low * std::pow(ratio, power), 3)));
  }
  return particles;
}

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

struct Stages {
  SpaceBins bins;
  SpaceField field;
  SpaceCrossings crossings;

  Stages(const SpaceParticles& particles, const Scale& scale) {
    EXPECT_TRUE(BinParticles(particles.AsFrame(), scale, {}, bins).ok());
    SampleField(bins, scale, field);
    FindCrossings(bins.bricks, field, crossings);
    EvaluateNodes(bins, scale, crossings.near, field);
  }
};

void ExpectFieldAgrees(std::uint64_t seed, double ratio, double kernel_radius, double cell_size,
                       int& exact, int& inside) {
  SCOPED_TRACE(::testing::Message() << "seed " << seed << ", ratio " << ratio);
  const SpaceParticles particles = RandomSizes(seed, ratio);
  if (particles.size() == 0) return;
  const ReconstructionParameters parameters = ParametersFor(kernel_radius, cell_size);
  const Scale scale = ScaleOf(particles, parameters);
  const Stages stages(particles, scale);
  const SizedOracle oracle(particles, parameters);
  Random random(seed);
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
    const double tolerance = 2e-4 * std::sqrt(ratio) + 2e-5 / (1e-3 + expected.kernel);
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

TEST(SpaceSizes, FieldAgreesWithSumsOverAllParticles) {
  int exact = 0, inside = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const double radius = random.Uniform(1.5, 4), cell = random.Uniform(.5, 2);
    ExpectFieldAgrees(seed, std::array{1.0, 3.0, 10.0, 30.0}[seed % 4], radius, cell, exact,
                      inside);
  }
  EXPECT_GT(exact, 3'000);
  EXPECT_GT(inside, 1'000);
}

TEST(SpaceSizes, EqualSizesGiveTheFieldOfEqualSizes) {
  for (const std::uint64_t seed : {2u, 3u, 5u, 8u}) {
    SpaceParticles particles = RandomSpaceScene(seed);
    particles.volumes.assign(particles.size(), 1);
    ReconstructionParameters parameters = ParametersFor(3, 1);
    const Stages own(particles, ScaleOf(particles, parameters));
    parameters.sizes = Sizes::kEqual;
    const Stages equal(particles, MakeScale(parameters, 1, 1, 1));
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

TEST(SpaceSizes, BitsOfTheFieldDependNeitherOnOrderNorOnThreads) {
  Random random(4);
  for (const std::uint64_t seed : {11u, 12u, 13u, 14u}) {
    const SpaceParticles particles = RandomSizes(seed, 5);
    const Scale scale = ScaleOf(particles, ParametersFor(3, 1));
    const Stages stages(particles, scale);
    for (const unsigned threads : {1u, 2u, 7u}) {
      const SpaceParticles shuffled = Shuffled(particles, random);
      Arena(threads).Execute([&] {
        const Stages other(shuffled, scale);
        EXPECT_EQ(other.field.values, stages.field.values);
        EXPECT_EQ(other.field.inside, stages.field.inside);
        EXPECT_EQ(other.bins.x, stages.bins.x);
        EXPECT_EQ(other.bins.size, stages.bins.size);
      });
    }
  }
}

TEST(SpaceSizes, GradientsAgreeWithDifferences) {
  Random random(5);
  int terms[4] = {};
  for (int trial = 0; trial < 600; ++trial) {
    SpaceParticles particles = testing::Ball({0, 0, 0}, random.Uniform(2, 4), .3, random);
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

Surface ReconstructOnce(const SurfaceParameters& parameters, const SpaceParticles& particles) {
  const auto reconstructor = SurfaceReconstructor::Create(parameters);
  EXPECT_TRUE(reconstructor.ok()) << reconstructor.status();
  SurfaceWorkspace workspace;
  SurfaceState state;
  Surface surface;
  const absl::Status status =
      reconstructor->Reconstruct(particles.AsFrame(), state, workspace, surface);
  EXPECT_TRUE(status.ok()) << status;
  return surface;
}

constexpr std::array kPlacements = {SurfacePlacement::kVirtualPlane,
                                    SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef};

TEST(SpaceSizes, RandomFramesKeepS1ToS5) {
  std::uint64_t shells = 0;
  for (std::uint64_t seed = 1; seed <= testing::Frames(300); ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Random random(seed);
    SurfaceParameters parameters{.placement = kPlacements[seed % 3], .sizes = Sizes::kOwn};
    if (random.Chance(.3)) parameters.placement = SurfacePlacement::kVirtualPlane;
    if (random.Chance(.2)) parameters.kernel_radius = random.Uniform(1.5, 4);
    if (random.Chance(.2)) parameters.cell_size = random.Uniform(.7, 2);
    if (random.Chance(.2)) parameters.max_drop_particles = 0;
    if (random.Chance(.1)) parameters.simplify = .1;
    if (random.Chance(.1)) parameters.thinning_distance = .2;
    const double ratio = std::array{1.5, 3.0, 10.0, 25.0}[random.Below(4)];
    const Surface surface = ReconstructOnce(parameters, RandomSizes(seed, ratio));
    const absl::Status status = Validate(surface);
    ASSERT_TRUE(status.ok()) << status;
    shells += surface.ShellCount();
  }
  EXPECT_GT(shells, testing::Frames(300));
}

TEST(SpaceSizes, BitsOfSurfacesDependNeitherOnOrderNorOnThreads) {
  Random random(3);
  for (const std::uint64_t seed : {21u, 22u, 23u, 24u, 25u, 26u}) {
    const SpaceParticles particles = RandomSizes(seed, 5);
    const SpaceParticles shuffled = Shuffled(particles, random);
    for (const SurfacePlacement placement : kPlacements) {
      const SurfaceParameters parameters{.placement = placement, .sizes = Sizes::kOwn};
      const Surface expected = ReconstructOnce(parameters, particles);
      for (const unsigned threads : {1u, 2u, 7u}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        Arena(threads).Execute([&] { EXPECT_EQ(ReconstructOnce(parameters, shuffled), expected); });
      }
    }
  }
}

/// A ball of two zones: a lattice of size 2 on one side, of size 1 on the other.
SpaceParticles TwoZones(double radius) {
  SpaceParticles particles;
  const auto add = [&](const Vec3& at, double size) {
    if (Length(at) > radius - size / 2) return;
    particles.Add(at);
    particles.volumes.push_back(static_cast<float>(size * size * size));
  };
  for (double z = -radius; z < radius; ++z) {
    for (double y = -radius; y < radius; ++y) {
      for (double x = 0; x < radius; ++x) add({x + .5, y + .5, z + .5}, 1);
      for (double x = 0; x < radius; x += 2) {
        if (std::fmod(y + radius, 2) < 1 && std::fmod(z + radius, 2) < 1) {
          add({-x - 1, y + 1, z + 1}, 2);
        }
      }
    }
  }
  return particles;
}

TEST(SpaceSizes, BitsDoNotDependOnTheInstructionSet) {
  const SpaceParticles zones = TwoZones(8);
  for (const SurfacePlacement placement : kPlacements) {
    const SurfaceParameters parameters{
        .placement = placement, .spacing = 1.2, .sizes = Sizes::kOwn};
    const Surface expected = ReconstructOnce(parameters, zones);
    const Surface other = ReconstructOnce(parameters, RandomSizes(7, 10));
    const int sets = support::ForEachInstructionSet([&] {
      EXPECT_EQ(ReconstructOnce(parameters, zones), expected);
      EXPECT_EQ(ReconstructOnce(parameters, RandomSizes(7, 10)), other);
    });
    EXPECT_GT(sets, 1) << "the processor has one instruction set only";
  }
}

TEST(SpaceSizes, BodiesHaveTheVolumeOfTheirParticles) {
  for (const double radius : {5.0, 8.0, 11.0}) {
    const SpaceParticles particles = TwoZones(radius);
    double wanted = 0;
    for (const float of : particles.volumes) wanted += of;
    const Surface surface = ReconstructOnce(
        {.placement = SurfacePlacement::kVirtualPlane, .sizes = Sizes::kOwn}, particles);
    ASSERT_EQ(surface.ShellCount(), 1u);
    EXPECT_NEAR(surface.measures[0].volume, wanted, .002 * wanted);
    EXPECT_EQ(surface.measures[0].particles, particles.size());
  }
}

// Drops of up to 30 particles have their volume exactly, whatever their sizes.
TEST(SpaceSizes, LoneParticlesAreBallsOfTheirVolume) {
  SpaceParticles particles;
  double wanted = 0;
  for (int k = 0; k < 8; ++k) {
    const double size = std::array{.12, .3, .5, 1.0, 1.7, 3.0, 6.0, 9.5}[k];
    particles.Add({60.0 * k + .3, .2, .4});
    particles.volumes.push_back(static_cast<float>(size * size * size));
    wanted += size * size * size;
  }
  const Surface surface = ReconstructOnce(
      {.placement = SurfacePlacement::kVirtualPlane, .sizes = Sizes::kOwn}, particles);
  ASSERT_EQ(surface.ShellCount(), particles.size());
  double volume = 0;
  for (const ShellMeasures& shell : surface.measures) volume += shell.volume;
  EXPECT_NEAR(volume, wanted, 1e-4 * wanted);
}

TEST(SpaceSizes, LargerUnitsScaleTheSurface) {
  const SpaceParticles particles = RandomSizes(33, 5);
  SpaceParticles scaled = particles;
  for (double& value : scaled.xyz) value /= 64;
  for (float& volume : scaled.volumes) volume /= 64.0f * 64 * 64;
  SurfaceParameters parameters{.placement = SurfacePlacement::kVirtualPlane, .sizes = Sizes::kOwn};
  const Surface surface = ReconstructOnce(parameters, particles);
  parameters.spacing = 1.0 / 64;
  const Surface other = ReconstructOnce(parameters, scaled);
  ASSERT_GT(surface.PointCount(), 100u);
  ASSERT_EQ(other.points.size(), surface.points.size());
  for (std::size_t k = 0; k < surface.points.size(); ++k) {
    ASSERT_NEAR(64 * other.points[k], surface.points[k], 1e-6);
  }
}

// A linear attribute is met at the points, also where sizes meet. Slopes are damped by the size.
TEST(SpaceSizes, AttributesAreInterpolatedByOwnKernels) {
  const SpaceParticles particles = TwoZones(8);
  std::vector<float> values;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const Vec3 at = particles.At(k);
    values.push_back(static_cast<float>(3 + .5 * at.x - .25 * at.y + at.z));
  }
  const Attribute attribute{"a", 1, values};
  Frame frame = particles.AsFrame();
  frame.attributes = std::span(&attribute, 1);
  const auto reconstructor = SurfaceReconstructor::Create(
      {.placement = SurfacePlacement::kVirtualPlane, .sizes = Sizes::kOwn});
  SurfaceWorkspace workspace;
  Surface surface;
  ASSERT_TRUE(reconstructor->Reconstruct(frame, workspace, surface).ok());
  ASSERT_EQ(surface.attributes.size(), 1u);
  for (std::size_t p = 0; p < surface.PointCount(); ++p) {
    const Vec3 at = Vec3At(surface.points, p);
    EXPECT_NEAR(surface.attributes[0].values[p], 3 + .5 * at.x - .25 * at.y + at.z, 2 * .06);
  }
}

/// The violation of a refused frame; the state stays as it is.
std::optional<Violation> RefusalOf(const SurfaceParameters& parameters,
                                   const SpaceParticles& particles) {
  const auto reconstructor = SurfaceReconstructor::Create(parameters);
  if (!reconstructor.ok()) return FindViolation(reconstructor.status());
  SurfaceWorkspace workspace;
  SurfaceState state;
  Surface surface;
  const absl::Status status =
      reconstructor->Reconstruct(particles.AsFrame(), state, workspace, surface);
  if (status.ok()) return std::nullopt;
  EXPECT_EQ(state, SurfaceState());
  return FindViolation(status);
}

TEST(SpaceSizes, RefusesSizesFarFromTheSpacing) {
  SpaceParticles particles;
  for (int k = 0; k < 40; ++k) particles.Add({1.0 * k, 0, 0});
  const SurfaceParameters own{.sizes = Sizes::kOwn};
  auto violation = RefusalOf(own, particles);
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->reason, kReasonCount);
  EXPECT_EQ(violation->field, "volumes");
  particles.volumes.assign(particles.size(), 1);
  for (const float volume : {1e18f, 1e-9f, 1010.0f, .00099f}) {
    particles.volumes[7] = volume;
    violation = RefusalOf(own, particles);
    ASSERT_TRUE(violation);
    EXPECT_EQ(violation->reason, kReasonOutOfRange);
    EXPECT_EQ(violation->field, "volumes[7]");
    EXPECT_EQ(violation->rule, "must have a cube root, the size, of 0.1 to 10 spacings of 1");
  }
  for (const float volume : {1000.0f, .001f}) {
    particles.volumes[7] = volume;
    EXPECT_FALSE(RefusalOf(own, particles));
  }
  // A kernel radius of 8 * 5 cells.
  particles.volumes[7] = 125;
  violation = RefusalOf({.kernel_radius = 8, .sizes = Sizes::kOwn}, particles);
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->field, "volumes[7]");
  EXPECT_EQ(violation->rule, "must have a cube root, the size, of 0.1 to 4 spacings of 1");
}

TEST(SpaceSizes, RefusesWhatHasNoOwnSizes) {
  ReconstructionParameters own{.output = Output::kSurface, .spacing = 1.0, .sizes = Sizes::kOwn};
  const auto field_of = [](const ReconstructionParameters& parameters) {
    const auto violation = FindViolation(Validate(parameters));
    return violation ? violation->field + "=" + violation->value : "";
  };
  EXPECT_EQ(field_of(own), "");
  ReconstructionParameters parameters = own;
  parameters.spacing.reset();
  EXPECT_EQ(field_of(parameters), "parameters.spacing=absent");
  parameters = own;
  parameters.sections = {{.slice = SlicePlane()}};
  EXPECT_EQ(field_of(parameters), "parameters.sizes=own");
  parameters = own;
  parameters.box = PeriodicBox{.axes = {PeriodicAxis{0, 100}}};
  EXPECT_EQ(field_of(parameters), "parameters.sizes=own");
  parameters = own;
  parameters.noise_filter = .5;
  EXPECT_EQ(field_of(parameters), "parameters.sizes=own");
  parameters = own;
  parameters.boundary = Boundary::kGrains;
  EXPECT_EQ(field_of(parameters), "parameters.boundary=grains");
  const auto created = SurfaceReconstructor::Create(
      {.sizes = Sizes::kOwn, .box = PeriodicBox{.axes = {PeriodicAxis{0, 100}}}});
  ASSERT_TRUE(FindViolation(created.status()));
  EXPECT_EQ(FindViolation(created.status())->field, "parameters.sizes");
}

}  // namespace
}  // namespace partiemc::space
