// Drops become ellipsoids.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "partiemc/surface_reconstructor.h"
#include "space/space_particles.h"
#include "support/tries.h"
#include "surface_workspace.h"

namespace partiemc {
namespace {

using support::Random;
using support::SpaceParticles;

Surface Reconstruct(const SpaceParticles& particles, std::uint64_t max_drop_particles = 30,
                    std::uint64_t min_component_particles = 0) {
  const auto reconstructor =
      SurfaceReconstructor::Create({.placement = SurfacePlacement::kVirtualPlane,
                                    .max_drop_particles = max_drop_particles,
                                    .min_component_particles = min_component_particles});
  SurfaceWorkspace workspace;
  Surface surface;
  EXPECT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).ok());
  const absl::Status status = Validate(surface);
  EXPECT_TRUE(status.ok()) << status.message();
  return surface;
}

Vec3 CentroidOf(const ShellMeasures& measures) {
  return {measures.centroid_x, measures.centroid_y, measures.centroid_z};
}

/// In a box of side 1.
Vec3 AnyPlace(Random& random) {
  const double x = random.Unit(), y = random.Unit();
  return {x, y, random.Unit()};
}

TEST(SpaceDrops, LoneParticlesHaveTheirVolumeWhereverTheyAre) {
  Random random(1);
  SpaceParticles particles;
  for (int k = 0; k < 60; ++k) {
    particles.Add(Vec3{5.0 * (k % 20), 5.0 * (k / 20), 0} + AnyPlace(random));
  }
  const Surface surface = Reconstruct(particles);
  ASSERT_EQ(surface.ShellCount(), 60u);
  for (std::size_t shell = 0; shell < 60; ++shell) {
    const ShellMeasures& measures = surface.measures[shell];
    EXPECT_EQ(surface.outer_of[shell], kNoShell);
    EXPECT_EQ(measures.particles, 1u);
    EXPECT_NEAR(measures.volume, 1, 1e-9);
    double nearest = 9;
    for (std::size_t k = 0; k < 60; ++k) {
      nearest = std::min(nearest, Length(CentroidOf(measures) - particles.At(k)));
    }
    EXPECT_LT(nearest, 1e-4);
  }
  EXPECT_NE(Reconstruct(particles, 0), surface);
  EXPECT_EQ(Reconstruct(particles, 30, 2).ShellCount(), 0u);
}

TEST(SpaceDrops, KeepTheirShapeWhenTheyMove) {
  Random random(2);
  SpaceParticles drop = support::Ball({0, 0, 0}, 1.6, .2, random), moved;
  ASSERT_GT(drop.size(), 12u);
  ASSERT_LE(drop.size(), 30u);
  const Vec3 step{3.3, -1.7, .4};
  for (std::size_t k = 0; k < drop.size(); ++k) moved.Add(drop.At(k) + step);
  const Surface before = Reconstruct(drop), after = Reconstruct(moved);
  ASSERT_EQ(before.triangles, after.triangles);
  ASSERT_EQ(before.ShellCount(), 1u);
  for (std::size_t k = 0; k < before.PointCount(); ++k) {
    EXPECT_LT(Length(Vec3At(before.points, k) + step - Vec3At(after.points, k)), 1e-4);
  }
  EXPECT_NEAR(before.measures[0].volume, static_cast<double>(drop.size()), 1e-9);
}

TEST(SpaceDrops, FollowTheMomentsOfTheirParticles) {
  SpaceParticles line;
  for (int k = 0; k < 6; ++k) line.Add({k + .3, .6 * k + .1, .2});
  const Surface surface = Reconstruct(line);
  ASSERT_EQ(surface.ShellCount(), 1u);
  EXPECT_NEAR(surface.measures[0].volume, 6, 1e-9);
  EXPECT_LT(Length(CentroidOf(surface.measures[0]) - Vec3{2.8, 1.6, .2}), 1e-4);
  // Thin and long.
  double most_across = 0, most_along = 0;
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    const Vec3 at = Vec3At(surface.points, k) - Vec3{2.8, 1.6, .2};
    most_across = std::max(most_across, std::abs(at.z));
    most_along = std::max(most_along, std::abs(at.x));
  }
  EXPECT_LT(most_across, .8);
  EXPECT_GT(most_along, 2.5);
}

TEST(SpaceDrops, KeepTheirSurfaceNearOthersAndWhereTheyAreBent) {
  Random random(3);
  // Over a slab, from touching it to far away from it.
  const SpaceParticles slab = support::Box({-5, -5, -4}, {5, 5, 0}, .1, random);
  int ellipsoids = 0, joined = 0;
  for (int step = 0; step < 20; ++step) {
    SpaceParticles particles = slab;
    particles.Add(Vec3{.2, .3, .2 * step + .5});
    const Surface surface = Reconstruct(particles);
    ellipsoids += surface.ShellCount() == 2 && std::abs(surface.measures[1].volume - 1) < 1e-9;
    joined += surface.ShellCount() == 1;
  }
  EXPECT_GT(ellipsoids, 5);
  EXPECT_GT(joined, 2);
  // Half a circle.
  SpaceParticles bow;
  for (int k = 0; k < 14; ++k) {
    const double angle = 3.14159 * k / 13;
    bow.Add({4.2 * std::cos(angle), 4.2 * std::sin(angle), 0});
  }
  EXPECT_EQ(Reconstruct(bow), Reconstruct(bow, 0));
}

/// One drop reaches into a brick that has too many drops, another drop is beside it.
TEST(SpaceDrops, KeepTheirSurfaceInABrickWithTooManyDrops) {
  const auto reconstructor = SurfaceReconstructor::Create(
      {.placement = SurfacePlacement::kVirtualPlane, .kernel_radius = 1.5, .cell_size = 4});
  ASSERT_TRUE(reconstructor.ok());
  for (const int count : {255, 256, 257, 2000}) {
    SCOPED_TRACE(count);
    SpaceParticles particles;
    particles.Add({31.9, 18, 18});  // Also reaches the brick behind x = 32.
    particles.Add({18, 18, 18});
    for (int k = 0; k < count; ++k) particles.Add({46, 14, 14});
    SurfaceWorkspace workspace;
    Surface surface;
    ASSERT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).ok());
    EXPECT_EQ(surface.ShellCount(), count < 256 ? 2u : 1u);
  }
}

/// Particles so far apart that nothing else can be near an ellipsoid: no vertex is placed for them.
TEST(SpaceDrops, AreSettledBeforeVerticesArePlaced) {
  Random random(4);
  SpaceParticles particles;
  for (int k = 0; k < 30; ++k) {
    const Vec3 at = Vec3{9.0 * (k % 6), 9.0 * (k / 6), 0} + 2 * AnyPlace(random);
    for (int n = k % 3; n >= 0; --n) particles.Add(at + .5 * AnyPlace(random));
  }
  const auto reconstructor =
      SurfaceReconstructor::Create({.placement = SurfacePlacement::kVirtualPlane});
  SurfaceWorkspace workspace;
  Surface surface;
  ASSERT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).ok());
  EXPECT_EQ(surface.ShellCount(), 30u);
  const SurfaceWorkspace::Buffers& b = workspace.buffers();
  EXPECT_EQ(std::ranges::count(b.drops.is_settled, 1), std::ssize(b.bodies.bodies));
  EXPECT_EQ(b.certificate.nodes.count, 0u);
  for (const ShellMeasures& measures : surface.measures) {
    EXPECT_NEAR(measures.volume, static_cast<double>(measures.particles), 1e-9);
  }
}

/// Over a rough slab with drops. In about one of a thousand such frames, the slab comes too near to
/// a settled drop.
SpaceParticles DropsOverSlab(std::uint64_t seed) {
  Random random(seed);
  SpaceParticles particles;
  const double jitter = .05 + .4 * random.Unit(), density = .002 + .05 * random.Unit();
  for (int k = 0; k < 18 * 18 * 4; ++k) {
    const Vec3 at{1.0 * (k % 18), 1.0 * (k / 18 % 18), 1.0 * (k / 324)};
    particles.Add(at + jitter * AnyPlace(random) + Vec3{0, 0, .5 * std::sin(.5 * at.x)});
  }
  for (double drop = 6480 * density; drop > 0; --drop) {
    const Vec3 at = 18 * AnyPlace(random) + Vec3{0, 0, 3.5};
    const std::uint64_t count = random.Chance(.7) ? 1 : 1 + random.Below(8);
    const double side = 1.1 * std::cbrt(static_cast<double>(count));
    for (std::uint64_t n = 0; n < count; ++n) {
      particles.Add(count == 1 ? at : at + side * AnyPlace(random));
    }
  }
  return particles;
}

TEST(SpaceDrops, ArePlacedAgainIfASettledOneIsRefused) {
  const auto reconstructor =
      SurfaceReconstructor::Create({.placement = SurfacePlacement::kVirtualPlane});
  SurfaceWorkspace workspace;
  Surface surface;
  for (const std::uint64_t seed : {2780, 2781}) {
    SCOPED_TRACE(seed);
    const SpaceParticles particles = DropsOverSlab(seed);
    ASSERT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface).ok());
    EXPECT_EQ(workspace.buffers().drops.is_settled.empty(), seed == 2781);
    EXPECT_TRUE(
        std::ranges::any_of(workspace.buffers().drops.drops, &space::Drops::Drop::is_taken));
    EXPECT_TRUE(Validate(surface).ok());
  }
}

/// Drops that touch each other, near walls and in cavities; also of tiny particles, and far away.
TEST(SpaceDrops, KeepS1ToS5) {
  for (std::uint64_t seed = 0; seed < support::Tries(10u); ++seed) {
    Random random(seed);
    SpaceParticles particles;
    const double side = random.Uniform(6, 30);
    const Vec3 origin = seed % 3 == 0 ? 1e6 * AnyPlace(random) : Vec3{};
    if (seed % 4 == 0) {
      const SpaceParticles block = support::Box({0, 0, 0}, {16, 16, 16}, .2, random);
      for (std::size_t k = 0; k < block.size(); ++k) {
        const Vec3 from = block.At(k) - Vec3{8, 8, 8};
        if (Length(from) > 6) particles.Add(origin + block.At(k));
      }
    }
    for (int k = 0; k < 40; ++k) {
      const Vec3 at = origin + side * AnyPlace(random);
      for (std::uint64_t n = 1 + random.Below(6); n > 0; --n) {
        particles.Add(at + 1.5 * AnyPlace(random));
      }
    }
    if (seed % 5 == 0) {
      for (std::size_t k = 0; k < particles.size(); ++k) {
        particles.volumes.push_back(static_cast<float>(std::pow(10, -4 * random.Unit())));
      }
    }
    SCOPED_TRACE(seed);
    Reconstruct(particles);
  }
}

}  // namespace
}  // namespace partiemc
