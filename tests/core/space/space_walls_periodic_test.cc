// Surfaces at walls of periodic boxes and of particles with own sizes: a body has the same surface
// across a face and in the middle of the box, and every surface is valid.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "base/vec3.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "space/exact_shapes.h"
#include "space/periodic_bodies.h"
#include "space/sized_bodies.h"
#include "space/surface_of.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::AddSized;
using support::BoxOf;
using support::ExpectInBox;
using support::MovedBy;
using support::Random;
using support::SpaceParticles;
using support::Sums;
using support::SumsOf;
using support::SurfaceOf;
using support::VolumeOf;
using support::Wrapped;

const WallPlane kFloor{.axis = 2};

SurfaceParameters OnFloorIn(const PeriodicBox& box, Sizes sizes = Sizes::kEqual) {
  return {.placement = SurfacePlacement::kVirtualPlane,
          .sizes = sizes,
          .box = box,
          .wall_planes = {kFloor}};
}

double HeightBefore(const WallPlane& wall, const Vec3& at) {
  const double from = std::array{at.x, at.y, at.z}[static_cast<std::size_t>(wall.axis)];
  return wall.is_fluid_above ? from - wall.position : wall.position - from;
}

double LeastHeight(const WallPlane& wall, const Surface& surface) {
  double least = 1e300;
  for (std::size_t p = 0; p < surface.PointCount(); ++p) {
    least = std::min(least, HeightBefore(wall, Vec3At(surface.points, p)));
  }
  return least;
}

/// The area of the triangles on a wall.
double WettedArea(const WallPlane& wall, const Surface& surface) {
  double area = 0;
  for (const std::uint32_t t : surface.cuts) {
    std::array<Vec3, 3> at;
    bool is_on_wall = true;
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = Vec3At(surface.points, surface.triangles[3 * t + k]);
      is_on_wall = is_on_wall && HeightBefore(wall, at[k]) == 0;
    }
    if (is_on_wall) area += Length(Cross(at[1] - at[0], at[2] - at[0])) / 2;
  }
  return area;
}

/// Fluid with a wavy surface on the floor, across a box of 24 x 20.
SpaceParticles WavyLayer() {
  Random random(3);
  return support::Filled(24, 20, 12, .1, random, [](const Vec3& at) {
    return at.z < 7 + 2 * std::sin(2 * M_PI * at.x / 24);
  });
}

/// Half a ball on the floor.
SpaceParticles Dome(double radius, double shake) {
  Random random(4);
  SpaceParticles ball = support::Ball({.25, .25, -.5}, radius, shake, random), dome;
  for (std::size_t k = 0; k < ball.size(); ++k) {
    if (ball.At(k).z > 0) dome.Add(ball.At(k));
  }
  return dome;
}

TEST(PeriodicWalls, ALayerOnAFloorIsCutAnywhereWithItsVolume) {
  const SpaceParticles layer = WavyLayer();
  const auto volume = static_cast<double>(layer.size());
  std::optional<Sums> first;
  double volume_error = 0, area_error = 0;
  for (const bool wraps : {false, true}) {
    for (const Vec3& origin : {Vec3{0, 0, 0}, Vec3{9, 0, 0}, Vec3{0, 5, 0}, Vec3{-7, 13, 0}}) {
      PeriodicBox box = BoxOf(24, 20, 0, origin);
      box.wraps = wraps;
      const Surface surface = SurfaceOf(Wrapped(layer, box), OnFloorIn(box));
      ASSERT_EQ(surface.ShellCount(), 1u);
      ExpectInBox(surface, box);
      EXPECT_EQ(LeastHeight(kFloor, surface), 0);
      EXPECT_NEAR(WettedArea(kFloor, surface), 480, 1e-3);
      const Sums sums = SumsOf(surface);
      if (!first) first = sums;
      EXPECT_NEAR(sums.volume, volume, 1e-3 * volume);
      volume_error = std::max(volume_error, std::abs(sums.volume / first->volume - 1));
      area_error = std::max(area_error, std::abs(sums.area / first->area - 1));
      EXPECT_EQ(sums.particles, layer.size());
    }
  }
  std::printf("layer: volume off by %.1e, places of the faces: volume %.1e, area %.1e\n",
              first->volume / volume - 1, volume_error, area_error);
  EXPECT_LT(volume_error, 1e-5);
  EXPECT_LT(area_error, 1e-4);
}

TEST(PeriodicWalls, ADropAcrossAFaceIsTheDropInTheMiddle) {
  const SpaceParticles dome = Dome(6, .1);
  std::optional<Sums> first;
  for (const Vec3& at : {Vec3{12, 12, 0}, Vec3{0, 12, 0}, Vec3{12, 0, 0}, Vec3{0, 0, 0}}) {
    const PeriodicBox box = BoxOf(25, 25, 0);
    const Surface surface = SurfaceOf(Wrapped(MovedBy(dome, at), box), OnFloorIn(box));
    ASSERT_EQ(surface.ShellCount(), 1u);
    EXPECT_EQ(LeastHeight(kFloor, surface), 0);
    const Sums sums = SumsOf(surface);
    if (!first) first = sums;
    EXPECT_NEAR(sums.volume, first->volume, 1e-6 * first->volume);
    EXPECT_NEAR(sums.area, first->area, 1e-6 * first->area);
    EXPECT_EQ(sums.particles, dome.size());
  }
  EXPECT_NEAR(first->volume / static_cast<double>(dome.size()), 1, .003);
  // In a box that wraps, the drop is in four pieces.
  PeriodicBox wraps = BoxOf(25, 25, 0);
  wraps.wraps = true;
  const Surface pieces = SurfaceOf(Wrapped(dome, wraps), OnFloorIn(wraps));
  EXPECT_EQ(pieces.ShellCount(), 4u);
  EXPECT_NEAR(SumsOf(pieces).volume, first->volume, 1e-3 * first->volume);
  EXPECT_NEAR(SumsOf(pieces).area, first->area, 1e-3 * first->area);
  EXPECT_EQ(SumsOf(pieces).particles, dome.size());
}

// A layer between two walls, with a cavity at the floor and a drop above that touches no wall.
TEST(PeriodicWalls, ChannelsDropsAndCavitiesAreClosed) {
  SpaceParticles scene;
  const SpaceParticles layer = WavyLayer();
  for (std::size_t k = 0; k < layer.size(); ++k) {
    const Vec3 at = layer.At(k);
    if (std::hypot(at.x - 12, at.y, at.z) > 3 && std::hypot(at.x - 12, at.y - 20, at.z) > 3) {
      scene.Add(at);
    }
  }
  const std::size_t in_layer = scene.size();
  Random random(5);
  scene.Add(support::Ball({23, 1, 16}, 3, .1, random));
  const PeriodicBox box = BoxOf(24, 0, 0);
  SurfaceParameters parameters = OnFloorIn(box);
  parameters.wall_planes.push_back({.axis = 1});
  parameters.wall_planes.push_back({.axis = 1, .position = 20, .is_fluid_above = false});
  const Surface surface = SurfaceOf(Wrapped(scene, box), parameters);
  ASSERT_EQ(surface.ShellCount(), 2u);
  for (const WallPlane& wall : parameters.wall_planes) EXPECT_EQ(LeastHeight(wall, surface), 0);
  const auto of_layer = std::ranges::find(surface.measures, in_layer, &ShellMeasures::particles);
  ASSERT_NE(of_layer, surface.measures.end());
  // The cavities in the lattice have no certain volume.
  EXPECT_NEAR(of_layer->volume, static_cast<double>(in_layer), .01 * static_cast<double>(in_layer));
  EXPECT_LT(WettedArea(kFloor, surface), 480 - 20);
}

TEST(PeriodicWalls, BodiesKeepIdentitiesWhileTheyCross) {
  for (const bool wraps : {false, true}) {
    PeriodicBox box = BoxOf(24, 20, 0);
    box.wraps = wraps;
    const auto reconstructor = SurfaceReconstructor::Create(OnFloorIn(box));
    ASSERT_TRUE(reconstructor.ok());
    SurfaceState state;
    SurfaceWorkspace workspace;
    Surface surface;
    const SpaceParticles dome = Dome(4, .1);
    std::uint64_t first = 0;
    for (int step = 0; step < 30; ++step) {
      SCOPED_TRACE(::testing::Message() << "wraps " << wraps << ", step " << step);
      const SpaceParticles now = Wrapped(MovedBy(dome, {.9 * step, -.7 * step, 0}), box);
      const absl::Status status =
          reconstructor->Reconstruct(now.AsFrame(), state, workspace, surface);
      ASSERT_TRUE(status.ok()) << status;
      ASSERT_TRUE(Validate(surface).ok()) << Validate(surface);
      std::uint64_t identity = 0;
      for (const ShellMeasures& shell : surface.measures) {
        if (shell.identity != 0) identity = shell.identity;
      }
      if (step == 0) first = identity;
      EXPECT_NE(identity, 0u);
      EXPECT_EQ(identity, first);
      EXPECT_EQ(SumsOf(surface).particles, dome.size());
    }
  }
}

TEST(PeriodicWalls, AttributesAreThoseOfTheFluid) {
  const SpaceParticles layer = WavyLayer();
  std::vector<float> heights;
  for (std::size_t k = 0; k < layer.size(); ++k) {
    heights.push_back(static_cast<float>(layer.At(k).z));
  }
  const std::vector<Attribute> attributes = {{"height", 1, heights}};
  Frame frame = layer.AsFrame();
  frame.attributes = attributes;
  const auto reconstructor = SurfaceReconstructor::Create(OnFloorIn(BoxOf(24, 20, 0)));
  SurfaceWorkspace workspace;
  Surface surface;
  const absl::Status status = reconstructor->Reconstruct(frame, workspace, surface);
  ASSERT_TRUE(status.ok()) << status;
  double farthest = 0;
  for (std::size_t p = 0; p < surface.PointCount(); ++p) {
    const double error = surface.attributes[0].values[p] - Vec3At(surface.points, p).z;
    farthest = std::max(farthest, std::abs(error));
  }
  EXPECT_LT(farthest, .2);
}

// Domes of sizes 1:3 on a wall, and a tank of mixed sizes.
TEST(SizedWalls, DropsAndTanksHaveTheirVolume) {
  for (const double degrees : {90., 120.}) {
    const double radius = 7, depth = radius * std::cos(degrees * M_PI / 180);
    Random random(7);
    const SpaceParticles ball =
        support::FillSized(*support::MakeSphere({}, radius), random,
                           [](Random& r, const Vec3&) { return r.Uniform(.5, 1.5); });
    SpaceParticles dome;
    for (std::size_t k = 0; k < ball.size(); ++k) {
      if (ball.At(k).z < depth) continue;
      dome.Add(ball.At(k));
      dome.volumes.push_back(ball.volumes[k]);
    }
    const WallPlane wall{.axis = 2, .position = depth};
    const Surface surface = SurfaceOf(dome, {.placement = SurfacePlacement::kVirtualPlane,
                                             .sizes = Sizes::kOwn,
                                             .wall_planes = {wall}});
    EXPECT_EQ(LeastHeight(wall, surface), 0);
    double off = 0, free = 0;
    for (std::size_t p = 0; p < surface.PointCount(); ++p) {
      const Vec3 at = Vec3At(surface.points, p);
      if (HeightBefore(wall, at) < 2) continue;
      off += std::abs(Length(at) - radius);
      ++free;
    }
    const double volume = support::SumOfVolumes(dome);
    std::printf("dome of sizes 1:3, %3.0f degrees: volume off by %.1e, free surface by %.3f\n",
                degrees, VolumeOf(surface) / volume - 1, off / free);
    EXPECT_NEAR(VolumeOf(surface), volume, .005 * volume);
    EXPECT_LT(off / free, .15);
  }
}

TEST(SizedWalls, LayersInBoxesKeepTheirVolume) {
  SpaceParticles layer = WavyLayer();
  Random random(8);
  support::DrawSizes(layer, .6, 1.3, random);
  const double volume = support::SumOfVolumes(layer);
  std::optional<Sums> first;
  for (const Vec3& origin : {Vec3{0, 0, 0}, Vec3{9, 0, 0}, Vec3{-7, 13, 0}}) {
    const PeriodicBox box = BoxOf(24, 20, 0, origin);
    const Surface surface = SurfaceOf(Wrapped(layer, box), OnFloorIn(box, Sizes::kOwn));
    ASSERT_EQ(surface.ShellCount(), 1u);
    ExpectInBox(surface, box);
    EXPECT_EQ(LeastHeight(kFloor, surface), 0);
    EXPECT_NEAR(WettedArea(kFloor, surface), 480, 1e-3);
    const Sums sums = SumsOf(surface);
    if (!first) first = sums;
    EXPECT_NEAR(sums.volume, volume, 1e-3 * volume);
    EXPECT_NEAR(sums.volume, first->volume, 1e-4 * volume);
    EXPECT_EQ(sums.particles, layer.size());
  }
}

/// Walls of all axes that are not periodic, through and beside the particles.
std::vector<WallPlane> WallsBeside(const PeriodicBox& box, const SpaceParticles& particles,
                                   double least_gap, Random& random) {
  std::vector<WallPlane> walls;
  for (int axis = 0; axis < 3; ++axis) {
    if (box.axes[static_cast<std::size_t>(axis)] || random.Chance(.2)) continue;
    const Vec3 at = particles.At(random.Below(particles.size()));
    const double through = std::array{at.x, at.y, at.z}[static_cast<std::size_t>(axis)];
    const double low = random.Chance(.3) ? std::floor(through) : through + random.Uniform(-2, 2);
    const bool is_above = random.Chance(.7);
    walls.push_back({axis, low, is_above});
    if (is_above && random.Chance(.4)) {
      walls.push_back({axis, low + least_gap + random.Uniform(.01, 9), false});
    }
  }
  return walls;
}

TEST(PeriodicWalls, RandomFramesKeepTheGuarantees) {
  SurfaceWorkspace workspace;
  std::uint64_t cut = 0, wetted = 0;
  const std::uint64_t frames = support::Tries(40u);
  for (std::uint64_t seed = 1; seed <= frames && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    Random random(104'729 * seed);
    SurfaceParameters parameters;
    parameters.placement = seed % 4 == 0   ? SurfacePlacement::kMarchingCubes
                           : seed % 4 == 1 ? SurfacePlacement::kQef
                                           : SurfacePlacement::kVirtualPlane;
    parameters.sizes = random.Chance(.4) ? Sizes::kOwn : Sizes::kEqual;
    parameters.kernel_radius = random.Chance(.3) ? 3 : random.Uniform(1.8, 2.5);
    parameters.cell_size = random.Chance(.5) ? 1 : random.Uniform(.7, 1.2);
    parameters.simplify = random.Chance(.2) ? .1 : 0;
    parameters.min_component_particles = random.Chance(.3) ? random.Below(12) : 0;
    const double least = 4 * parameters.kernel_radius;
    const auto length = [&] { return 1.4 * least * random.Uniform(1.001, 1.5); };
    const double x = length(), y = length();
    const bool is_layer = random.Chance(.5);
    const double height = random.Uniform(1, 9), wave = random.Uniform(0, 4);
    SpaceParticles particles =
        is_layer ? support::Filled(static_cast<int>(x), static_cast<int>(y), 14, .2, random,
                                   [&](const Vec3& at) {
                                     return at.z < height + wave * std::sin(2 * M_PI * at.x / x);
                                   })
                 : support::Uniform(static_cast<std::size_t>(random.Uniform(.02, .8) * x * y * 8),
                                    {x, y, 8}, random);
    particles.Add(support::Uniform(random.Below(30) + 1, {x, y, 14}, random));
    if (parameters.sizes == Sizes::kOwn) support::DrawSizes(particles, .7, 1.25, random);
    parameters.box = BoxOf(x, random.Chance(.6) ? y : 0, 0);
    parameters.box->wraps = random.Chance(.4);
    parameters.wall_planes =
        WallsBeside(*parameters.box, particles, 1.8 * parameters.kernel_radius, random);
    if (random.Chance(.1)) parameters.box.reset();
    if (parameters.box) particles = Wrapped(std::move(particles), *parameters.box);
    const Surface surface = SurfaceOf(particles, parameters, workspace);
    cut += surface.cuts.empty() ? 0 : 1;
    EXPECT_LE(SumsOf(surface).particles, particles.size());
    for (const WallPlane& wall : parameters.wall_planes) {
      ASSERT_GE(LeastHeight(wall, surface), 0);
      wetted += WettedArea(wall, surface) > 0 ? 1 : 0;
    }
  }
  std::printf("%llu frames, %llu with cuts, %llu wetted walls\n",
              static_cast<unsigned long long>(frames), static_cast<unsigned long long>(cut),
              static_cast<unsigned long long>(wetted));
  EXPECT_GT(cut, frames / 2);
  EXPECT_GT(wetted, frames / 3);
}

TEST(PeriodicWalls, BitsDependNeitherOnThreadsNorOnOrder) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 7);
  Random random(2);
  for (const Sizes sizes : {Sizes::kEqual, Sizes::kOwn}) {
    const PeriodicBox box = BoxOf(24, 20, 0);
    SpaceParticles scene = WavyLayer();
    scene.Add(MovedBy(Dome(3, .1), {1, 1, 13}));
    if (sizes == Sizes::kOwn) support::DrawSizes(scene, .7, 1.2, random);
    const Surface expected = SurfaceOf(scene, OnFloorIn(box, sizes));
    const SpaceParticles shuffled = support::Shuffled(scene, random);
    for (const unsigned threads : {1u, 2u, 7u}) {
      Arena(threads).Execute(
          [&] { EXPECT_EQ(SurfaceOf(shuffled, OnFloorIn(box, sizes)), expected); });
    }
  }
}

TEST(PeriodicWalls, ErrorsNameAGivenParticleOrAWall) {
  const auto violation_of = [](const SpaceParticles& particles,
                               const SurfaceParameters& parameters) {
    const auto reconstructor = SurfaceReconstructor::Create(parameters);
    EXPECT_TRUE(reconstructor.ok()) << reconstructor.status();
    SurfaceWorkspace workspace;
    Surface surface;
    return FindViolation(reconstructor->Reconstruct(particles.AsFrame(), workspace, surface));
  };
  SpaceParticles scene;
  scene.Add({3, 3, -9});  // Behind the floor: no effect.
  scene.Add(WavyLayer());
  const PeriodicBox box = BoxOf(24, 20, 0);
  EXPECT_FALSE(violation_of(scene, OnFloorIn(box)));
  scene.xyz[3 * 7 + 2] = 1e12;
  EXPECT_EQ(violation_of(scene, OnFloorIn(box))->field, "positions[7].z");
  scene.xyz[3 * 7] = 1e12;
  scene.xyz[3 * 7 + 2] = 3;
  EXPECT_EQ(violation_of(scene, OnFloorIn(box))->field, "positions[7].x");
  // All particles are behind the floor.
  SpaceParticles below;
  below.Add({3, 3, -9});
  EXPECT_FALSE(violation_of(below, OnFloorIn(box)));
  // Two walls closer than the kernel of the largest particle.
  SurfaceParameters sized = OnFloorIn({}, Sizes::kOwn);
  sized.box.reset();
  sized.wall_planes.push_back({.axis = 2, .position = 5, .is_fluid_above = false});
  SpaceParticles two;
  two.xyz = {0, 0, 1, 0, 0, 4};
  two.volumes = {1, 8};
  const auto violation = violation_of(two, sized);
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->field, "parameters.wall_planes[1].position");
  EXPECT_TRUE(violation->rule.ends_with("6, for the largest particle")) << violation->rule;
  two.volumes[1] = 4;
  EXPECT_FALSE(violation_of(two, sized));
  // Exactly the least distance and length, but for the rounding of the size.
  sized.wall_planes[1].position = 3 * std::cbrt(4.);
  EXPECT_FALSE(violation_of(two, sized));
  sized.box = BoxOf(12 * std::cbrt(4.), 0, 0);
  EXPECT_FALSE(violation_of(two, sized));
}

}  // namespace
}  // namespace partiemc
