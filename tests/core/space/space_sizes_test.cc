// Surfaces of particles with own sizes: guarantees, bits, volumes, attributes, refusals
// (core/SIZES.md, "Surfaces").
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "space/sized_bodies.h"
#include "space/space_particles.h"
#include "support/instruction_sets.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Random;
using support::RandomSizedScene;
using support::Shuffled;
using support::SpaceParticles;

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
  for (std::uint64_t seed = 1; seed <= support::Tries(100u); ++seed) {
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
    const Surface surface = ReconstructOnce(parameters, RandomSizedScene(seed, ratio));
    const absl::Status status = Validate(surface);
    ASSERT_TRUE(status.ok()) << status;
    shells += surface.ShellCount();
  }
  EXPECT_GT(shells, support::Tries(100u));
}

TEST(SpaceSizes, BitsOfSurfacesDependNeitherOnOrderNorOnThreads) {
  Random random(3);
  for (const std::uint64_t seed : {21u, 22u, 23u, 24u, 25u, 26u}) {
    const SpaceParticles particles = RandomSizedScene(seed, 5);
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
    const Surface other = ReconstructOnce(parameters, RandomSizedScene(7, 10));
    const int sets = support::ForEachInstructionSet([&] {
      EXPECT_EQ(ReconstructOnce(parameters, zones), expected);
      EXPECT_EQ(ReconstructOnce(parameters, RandomSizedScene(7, 10)), other);
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

// The small particle often has no inside node. It once belonged to the body of the large one, whose
// surface then became flat.
TEST(SpaceSizes, ASmallParticleFarFromALargeOneIsABallOfItsOwn) {
  Random random(5);
  for (const double distance : {3., 4.}) {
    for (int placed = 0; placed < 40; ++placed) {
      SCOPED_TRACE(::testing::Message() << "distance " << distance << ", placement " << placed);
      const Vec3 from = {random.Uniform(0, 1), random.Uniform(0, 1), random.Uniform(0, 1)};
      const Vec3 along = {random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)};
      const Vec3 to = from + (distance / std::sqrt(Dot(along, along))) * along;
      SpaceParticles particles;
      particles.Add(from);
      particles.Add(to);
      particles.volumes = {1, .125f};
      const Surface surface = ReconstructOnce(
          {.placement = SurfacePlacement::kVirtualPlane, .sizes = Sizes::kOwn}, particles);
      ASSERT_EQ(surface.ShellCount(), 2u);
      const double first = surface.measures[0].volume, second = surface.measures[1].volume;
      EXPECT_NEAR(std::min(first, second), .125, 1e-5);
      EXPECT_NEAR(std::max(first, second), 1, 1e-4);
    }
  }
}

TEST(SpaceSizes, LargerUnitsScaleTheSurface) {
  const SpaceParticles particles = RandomSizedScene(33, 5);
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

// A stream of surfaces has the surfaces of SurfaceReconstructor, and follows their bodies.
TEST(SpaceSizes, StreamsFollowBodies) {
  const auto reconstructor =
      Reconstructor::Create({.output = Output::kSurface, .spacing = 1.2, .sizes = Sizes::kOwn});
  ASSERT_TRUE(reconstructor.ok());
  SpaceParticles particles = TwoZones(6);
  std::vector<std::uint64_t> ids(particles.size());
  for (std::size_t k = 0; k < ids.size(); ++k) ids[k] = k;
  State state;
  Workspace workspace;
  Result result;
  std::uint64_t identity = 0;
  for (int frame = 0; frame < 4; ++frame) {
    for (double& value : particles.xyz) value += .4;
    Frame moved = particles.AsFrame();
    moved.ids = ids;
    ASSERT_TRUE(reconstructor->Reconstruct(moved, state, workspace, result).ok());
    Surface expected = ReconstructOnce(
        {.placement = SurfacePlacement::kVirtualPlane, .spacing = 1.2, .sizes = Sizes::kOwn},
        particles);
    EXPECT_EQ(result.surface.points, expected.points);
    EXPECT_EQ(result.surface.triangles, expected.triangles);
    ASSERT_EQ(result.surface.ShellCount(), 1u);
    const std::uint64_t now = result.surface.measures[0].identity;
    EXPECT_EQ(now, frame == 0 ? now : identity);
    EXPECT_GT(now, 0u);
    identity = now;
    EXPECT_DOUBLE_EQ(result.statistics.spacing, 1.2);
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
  parameters.noise_filter = .5;
  EXPECT_EQ(field_of(parameters), "parameters.sizes=own");
  parameters = own;
  parameters.boundary = Boundary::kGrains;
  EXPECT_EQ(field_of(parameters), "parameters.boundary=grains");
}

}  // namespace
}  // namespace partiemc
