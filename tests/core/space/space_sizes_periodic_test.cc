// Surfaces of particles with own sizes in periodic boxes: a body has the same surface across a face
// and in the middle of the box, and every surface is valid.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
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
using support::Cube;
using support::DrawSizes;
using support::ExpectInBox;
using support::MovedBy;
using support::Random;
using support::SpaceParticles;
using support::SumOfVolumes;
using support::Sums;
using support::SumsOf;
using support::SurfaceOf;
using support::Wrapped;

SurfaceParameters SizedInBox(const PeriodicBox& box,
                             SurfacePlacement placement = SurfacePlacement::kVirtualPlane) {
  return {.placement = placement, .sizes = Sizes::kOwn, .box = box};
}

/// A ball of mixed sizes, 1:3, at rest around the origin.
const SpaceParticles& SizedBall() {
  static const SpaceParticles ball = [] {
    Random random(7);
    return support::FillSized(*support::MakeSphere({}, 5), random,
                              [](Random& r, const Vec3&) { return r.Uniform(.5, 1.5); });
  }();
  return ball;
}

/// A layer of a wavy surface across a box of 24 x 20.
SpaceParticles SizedLayer() {
  Random random(3);
  SpaceParticles layer = support::Filled(24, 20, 12, .15, random, [](const Vec3& at) {
    return at.z < 7 + 2 * std::sin(2 * M_PI * at.x / 24);
  });
  DrawSizes(layer, .6, 1.3, random);
  return layer;
}

class SizedBoxSurface : public ::testing::TestWithParam<SurfacePlacement> {};
INSTANTIATE_TEST_SUITE_P(Placements, SizedBoxSurface,
                         ::testing::Values(SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                           SurfacePlacement::kVirtualPlane));

TEST_P(SizedBoxSurface, BallAcrossFaceEdgeAndCornerIsTheBallInTheMiddle) {
  const PeriodicBox box = Cube(28);
  const Surface middle = SurfaceOf(MovedBy(SizedBall(), {14, 14, 14}),
                                   {.placement = GetParam(), .sizes = Sizes::kOwn});
  ASSERT_EQ(middle.ShellCount(), 1u);
  const ShellMeasures& wanted = middle.measures[0];
  for (const Vec3& centre : {Vec3{0, 14, 14}, {14, 0, 0}, {0, 0, 0}, {27, 27, 2}}) {
    const SpaceParticles ball = Wrapped(MovedBy(SizedBall(), centre), box);
    const Surface across = SurfaceOf(ball, SizedInBox(box, GetParam()));
    ASSERT_EQ(across.ShellCount(), 1u);
    const ShellMeasures& is = across.measures[0];
    EXPECT_NEAR(is.volume, wanted.volume, 1e-6 * wanted.volume);
    EXPECT_NEAR(is.area, wanted.area, 1e-6 * wanted.area);
    EXPECT_EQ(is.particles, wanted.particles);
  }
  const PeriodicBox wraps = Cube(28, true);
  const Surface wrapped = SurfaceOf(Wrapped(SizedBall(), wraps), SizedInBox(wraps, GetParam()));
  ExpectInBox(wrapped, wraps);
  const Sums sums = SumsOf(wrapped);
  EXPECT_NEAR(sums.volume, wanted.volume, 1e-3 * wanted.volume);
  EXPECT_NEAR(sums.area, wanted.area, 1e-3 * wanted.area);
  EXPECT_EQ(sums.particles, wanted.particles);
}

// Where the faces lie does not matter.
TEST(SpaceSizesPeriodic, LayerIsCutAnywhereWithItsVolume) {
  const SpaceParticles layer = SizedLayer();
  const double volume = SumOfVolumes(layer);
  std::optional<Sums> first;
  for (const Vec3& origin : {Vec3{0, 0, 0}, Vec3{9, 0, 0}, Vec3{0, 5, 0}, Vec3{-7, 13, 0}}) {
    const PeriodicBox box = BoxOf(24, 20, 0, origin);
    const Surface surface = SurfaceOf(Wrapped(layer, box), SizedInBox(box));
    ASSERT_EQ(surface.ShellCount(), 1u);
    EXPECT_FALSE(surface.cuts.empty());
    ExpectInBox(surface, box);
    const Sums sums = SumsOf(surface);
    if (!first) first = sums;
    EXPECT_NEAR(sums.volume, volume, 1e-3 * volume);
    EXPECT_NEAR(sums.volume, first->volume, 1e-4 * volume);
    EXPECT_NEAR(sums.area, first->area, 1e-3 * first->area);
    EXPECT_EQ(sums.particles, layer.size());
  }
}

TEST(SpaceSizesPeriodic, BallNearALayerStaysWhole) {
  std::optional<double> volume;
  for (const double x : {0.0, 12.0, 23.0}) {
    const PeriodicBox box = BoxOf(24, 20, 0);
    SpaceParticles scene = SizedLayer();
    AddSized(scene, MovedBy(SizedBall(), {x, 1, 18}));
    const Surface surface = SurfaceOf(Wrapped(scene, box), SizedInBox(box));
    ASSERT_EQ(surface.ShellCount(), 2u);
    const auto ball =
        std::ranges::find(surface.measures, SizedBall().size(), &ShellMeasures::particles);
    ASSERT_NE(ball, surface.measures.end());
    if (!volume) volume = ball->volume;
    EXPECT_NEAR(ball->volume, *volume, 1e-5 * *volume);
  }
}

// A layer and a ball drift through a box whose length is no whole number of cells, and which
// stretches by up to 3 %.
TEST(SpaceSizesPeriodic, BodiesKeepIdentitiesWhileTheyCross) {
  for (const bool wraps : {false, true}) {
    PeriodicBox box = BoxOf(24, 20, 0);
    box.wraps = wraps;
    const auto reconstructor = SurfaceReconstructor::Create(SizedInBox(box));
    ASSERT_TRUE(reconstructor.ok());
    SurfaceState state;
    SurfaceWorkspace workspace;
    Surface surface;
    SpaceParticles scene = SizedLayer();
    AddSized(scene, MovedBy(SizedBall(), {5, 3, 20}));
    std::vector<std::uint64_t> first;
    for (int step = 0; step < 12; ++step) {
      SCOPED_TRACE(::testing::Message() << "wraps " << wraps << ", step " << step);
      const double stretch = 1 + .03 * std::sin(.5 * step);
      SpaceParticles now = MovedBy(scene, {.9 * step, -.7 * step, 0});
      for (std::size_t k = 0; k < now.xyz.size(); k += 3) now.xyz[k] *= stretch;
      for (float& volume : now.volumes) volume *= static_cast<float>(stretch);
      const PeriodicBox of_frame = BoxOf(24 * stretch, 20, 0);
      now = Wrapped(now, of_frame);
      Frame frame = now.AsFrame();
      frame.box = of_frame;
      frame.time = step;
      const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, surface);
      ASSERT_TRUE(status.ok()) << status;
      const absl::Status valid = Validate(surface);
      ASSERT_TRUE(valid.ok()) << valid;
      std::vector<std::uint64_t> identities;
      for (const ShellMeasures& shell : surface.measures) {
        if (shell.identity != 0) identities.push_back(shell.identity);
      }
      std::ranges::sort(identities);
      if (step == 0) first = identities;
      EXPECT_EQ(first.size(), 2u);
      EXPECT_EQ(identities, first);
      EXPECT_EQ(SumsOf(surface).particles, scene.size());
    }
  }
}

/// A random frame in a small box: noise of any density, or a layer with balls.
SpaceParticles RandomSizedInBox(double lengths, double largest, double ratio, Random& random) {
  SpaceParticles particles;
  const auto add = [&](const Vec3& at) {
    const double size = largest * std::pow(ratio, -random.Unit());
    particles.Add(at);
    particles.volumes.push_back(static_cast<float>(size * size * size));
    return size * size * size;
  };
  const double height = random.Chance(.5) ? lengths : random.Uniform(1, 5);
  double left = random.Uniform(.02, 1.1) * lengths * lengths * height;
  while (left > 0) {
    const double x = random.Uniform(0, lengths), y = random.Uniform(0, lengths);
    left -= add({x, y, random.Uniform(0, height)});
  }
  for (std::size_t k = random.Below(30); k > 0; --k) {
    const double x = random.Uniform(0, lengths), y = random.Uniform(0, lengths);
    add({x, y, random.Uniform(0, lengths)});
  }
  return particles;
}

TEST(SpaceSizesPeriodic, RandomFramesKeepS1ToS5) {
  std::uint64_t cut = 0;
  SurfaceWorkspace workspace;
  for (std::uint64_t seed = 1; seed <= support::Tries(24u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    SurfaceParameters parameters = SizedInBox({});
    parameters.placement = seed % 4 == 0   ? SurfacePlacement::kMarchingCubes
                           : seed % 4 == 1 ? SurfacePlacement::kQef
                                           : SurfacePlacement::kVirtualPlane;
    parameters.kernel_radius = random.Chance(.3) ? 3 : random.Uniform(1.8, 2.5);
    parameters.cell_size = random.Chance(.5) ? 1 : random.Uniform(.7, 1.2);
    parameters.simplify = random.Chance(.2) ? .1 : 0;
    parameters.min_component_particles = random.Chance(.3) ? random.Below(12) : 0;
    const double ratio = std::array{1.5, 3.0, 3.0, 8.0}[random.Below(4)];
    const double largest = std::pow(ratio, random.Uniform(.1, .3));
    const double length =
        4 * parameters.kernel_radius * std::max(1.0, largest) * random.Uniform(1.001, 1.25);
    const SpaceParticles particles = RandomSizedInBox(length, largest, ratio, random);
    const double x = random.Uniform(-9, 9), y = random.Uniform(-9, 9);
    parameters.box = BoxOf(length, random.Chance(.8) ? length : 0, random.Chance(.6) ? length : 0,
                           {x, y, random.Uniform(-9, 9)});
    parameters.box->wraps = seed % 3 == 0;
    const Surface surface = SurfaceOf(Wrapped(particles, *parameters.box), parameters, workspace);
    EXPECT_LE(SumsOf(surface).particles, particles.size());
    cut += surface.cuts.empty() ? 0 : 1;
  }
  EXPECT_GT(cut, support::Tries(24u) / 3);
}

TEST(SpaceSizesPeriodic, BitsDependNeitherOnThreadsNorOnOrder) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 7);
  Random random(2);
  for (const bool wraps : {false, true}) {
    PeriodicBox box = BoxOf(24, 20, 0);
    box.wraps = wraps;
    SpaceParticles scene = SizedLayer();
    AddSized(scene, MovedBy(SizedBall(), {0, 1, 19}));
    scene = Wrapped(scene, box);
    const Surface expected = SurfaceOf(scene, SizedInBox(box));
    const SpaceParticles shuffled = support::Shuffled(scene, random);
    for (const unsigned threads : {1u, 2u, 7u}) {
      Arena(threads).Execute([&] { EXPECT_EQ(SurfaceOf(shuffled, SizedInBox(box)), expected); });
    }
  }
}

TEST(SpaceSizesPeriodic, ErrorsNameTheBoxOrAGivenParticle) {
  SpaceParticles scene = SizedLayer();
  const auto violation_of = [&](const PeriodicBox& box) {
    const auto reconstructor = SurfaceReconstructor::Create(SizedInBox(box));
    EXPECT_TRUE(reconstructor.ok());
    SurfaceWorkspace workspace;
    Surface surface;
    return FindViolation(reconstructor->Reconstruct(scene.AsFrame(), workspace, surface));
  };
  EXPECT_FALSE(violation_of(BoxOf(24, 20, 0)));
  scene.volumes[5] = 8;  // A kernel radius of 6.
  EXPECT_FALSE(violation_of(BoxOf(24.1, 24.1, 0)));
  EXPECT_EQ(violation_of(BoxOf(24.1, 23.9, 0))->field, "parameters.box.y.length");
  scene.volumes[5] = 1331;
  EXPECT_EQ(violation_of(BoxOf(24, 20, 0))->field, "volumes[5]");
}

}  // namespace
}  // namespace partiemc
