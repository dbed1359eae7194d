// Surfaces in boxes that wrap, and in boxes that change from frame to frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "base/vec3.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "space/periodic_bodies.h"
#include "space/surface_of.h"
#include "space/surface_stream.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Cube;
using support::ExpectInBox;
using support::In;
using support::Known;
using support::Random;
using support::SpaceParticles;
using support::Sums;
using support::SumsOf;
using support::SurfaceStream;
using support::TrackedParticles;
using support::Wrap;

// The first surface of a stream, with identities.
Surface FirstSurface(const SurfaceParameters& parameters, const SpaceParticles& particles) {
  SurfaceStream stream(parameters);
  const absl::Status status = stream.Try(particles.AsFrame());
  EXPECT_TRUE(status.ok()) << status;
  const absl::Status valid = Validate(stream.surface());
  EXPECT_TRUE(valid.ok()) << valid;
  return stream.surface();
}

SpaceParticles MovedBall(const Vec3& centre, double radius) {
  Random random(1);
  SpaceParticles ball = support::Ball({0, 0, 0}, radius, .2, random), moved;
  for (std::size_t k = 0; k < ball.size(); ++k) moved.Add(ball.At(k) + centre);
  return moved;
}

class WrappedSurface : public ::testing::TestWithParam<SurfacePlacement> {};
INSTANTIATE_TEST_SUITE_P(Placements, WrappedSurface,
                         ::testing::Values(SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                           SurfacePlacement::kVirtualPlane));

TEST_P(WrappedSurface, BallAcrossFaceEdgeAndCornerIsCut) {
  const PeriodicBox box = Cube(32, true);
  const Sums middle = SumsOf(FirstSurface(In(Cube(32), GetParam()), MovedBall({16, 16, 16}, 6)));
  std::size_t pieces = 2;
  for (const Vec3& centre : {Vec3{0, 16, 16}, {16, 0, 0}, {0, 0, 0}}) {
    SCOPED_TRACE(pieces);
    SpaceParticles ball = MovedBall(centre, 6);
    Wrap(ball.xyz, box);
    const Surface surface = FirstSurface(In(box, GetParam()), ball);
    EXPECT_EQ(surface.ShellCount(), pieces);
    ExpectInBox(surface, box);
    EXPECT_GT(surface.cuts.size(), 0u);
    const Sums sums = SumsOf(surface);
    EXPECT_NEAR(sums.volume, middle.volume, 1e-4 * middle.volume);
    EXPECT_NEAR(sums.area, middle.area, 1e-4 * middle.area);
    EXPECT_EQ(sums.particles, ball.size());
    EXPECT_EQ(std::ranges::count(surface.measures, 1u, &ShellMeasures::identity), 1);
    pieces *= 2;
  }
  // In the middle of the box, nothing is cut.
  const Surface whole = FirstSurface(In(box, GetParam()), MovedBall({16, 16, 16}, 6));
  EXPECT_EQ(whole.ShellCount(), 1u);
  EXPECT_TRUE(whole.cuts.empty());
}

// Drops are ellipsoids, as without wrapping, and those across faces are cut.
TEST(WrappedSpace, SmallDropsKeepTheirVolumes) {
  const PeriodicBox box = Cube(33, true);
  for (std::uint64_t seed = 1; seed <= support::Tries(20u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    SpaceParticles all;
    const double x = random.Uniform(0, 33), y = random.Uniform(0, 33), z = random.Uniform(0, 33);
    for (int site = 0; site < 27; ++site) {
      const Vec3 at{x + 11. * (site % 3), y + 11. * (site / 3 % 3), z + 11. * (site / 9)};
      for (std::size_t count = site % 3 == 0 ? 1 : random.Below(30) + 1; count > 0; --count) {
        const double dx = random.Uniform(-1, 1), dy = random.Uniform(-1, 1);
        all.Add(at + Vec3{dx, dy, random.Uniform(-1, 1)});
      }
    }
    Wrap(all.xyz, box);
    const Surface surface = FirstSurface(In(box), all);
    ExpectInBox(surface, box);
    const Sums sums = SumsOf(surface), whole = SumsOf(FirstSurface(In(Cube(33)), all));
    EXPECT_EQ(sums.particles, all.size());
    EXPECT_NEAR(sums.volume, whole.volume, 1e-3 * whole.volume);
    EXPECT_NEAR(sums.area, whole.area, 1e-3 * whole.area);
    std::vector<std::uint64_t> identities;
    for (const ShellMeasures& shell : surface.measures) {
      if (shell.identity != 0) identities.push_back(shell.identity);
    }
    std::ranges::sort(identities);
    ASSERT_EQ(identities.size(), 27u);
    for (std::size_t k = 0; k < 27; ++k) EXPECT_EQ(identities[k], k + 1);
  }
}

class WrappedBodies : public ::testing::TestWithParam<Known> {};
INSTANTIATE_TEST_SUITE_P(With, WrappedBodies,
                         ::testing::Values(support::kNothing, support::kIds, support::kVelocities,
                                           support::kBoth),
                         ::testing::PrintToStringParamName());

TEST_P(WrappedBodies, KeepTheirIdentities) {
  const PeriodicBox box = Cube(40.3, true, -3);
  SurfaceStream stream(In(box));
  for (int frame = 0; frame < 50; ++frame) {
    SCOPED_TRACE(frame);
    TrackedParticles particles{.known = GetParam(), .time = 1.0 * frame};
    const Vec3 a{.9, -.8, .7}, b{.4, 0, -.3};
    particles.Add(MovedBall({0, 0, 0}, 5), 0, a, Vec3{20, 20, 20} + (1.0 * frame) * a);
    SpaceParticles lone;
    lone.Add({0, 0, 0});
    if (GetParam().ids || GetParam().velocities) {
      particles.Add(lone, 9000, b, Vec3{1, 1, 1} + (1.0 * frame) * b);
    }
    Wrap(particles.xyz, box);
    const Surface& surface = stream.Next(particles);
    ASSERT_TRUE(Validate(surface).ok());
    ExpectInBox(surface, box);
    for (const ShellMeasures& shell : surface.measures) EXPECT_LE(shell.identity, 2u);
  }
}

TEST(WrappedSpace, ThreadsAndOrderChangeNoBit) {
  const PeriodicBox box = Cube(36.5, true);
  Random random(4);
  SpaceParticles all = MovedBall({1, 2, 3}, 6);
  all.Add(MovedBall({18, 1, 18}, 4));
  for (int k = 0; k < 60; ++k) {
    const double x = random.Uniform(0, 36), y = random.Uniform(0, 36);
    all.Add({x, y, random.Uniform(0, 36)});
  }
  Wrap(all.xyz, box);
  const Surface first = FirstSurface(In(box), all);
  EXPECT_EQ(FirstSurface(In(box), support::Shuffled(all, random)), first);
  Arena arena(2);
  arena.Execute([&] { EXPECT_EQ(FirstSurface(In(box), all), first); });
}

double StretchAt(int frame) {
  const int step = frame % 24;
  return std::pow(1.01, step < 6 ? step : step < 18 ? 12 - step : step - 24);
}

// The box of the stream and particles, stretched about the centre of the box, and wrapped.
PeriodicBox Stretch(const PeriodicBox& box, const std::array<double, 3>& stretch,
                    std::vector<double>& xyz) {
  PeriodicBox now = box;
  for (std::size_t k = 0; k < 3; ++k) {
    auto& [origin, length] = *now.axes[k];
    const double centre = origin + .5 * length;
    for (std::size_t p = k; p < xyz.size(); p += 3)
      xyz[p] = centre + stretch[k] * (xyz[p] - centre);
    length *= stretch[k];
    origin = centre - .5 * length;
  }
  Wrap(xyz, now);
  return now;
}

using BreathingCase = std::tuple<Known, bool>;
class BreathingSpace : public ::testing::TestWithParam<BreathingCase> {};
INSTANTIATE_TEST_SUITE_P(With, BreathingSpace,
                         ::testing::Combine(::testing::Values(support::kNothing, support::kIds,
                                                              support::kVelocities, support::kBoth),
                                            ::testing::Bool()));

// Balls across the corner and a face of a wide box.
TEST_P(BreathingSpace, BodiesKeepIdentitiesAndVolumes) {
  const auto [known, wraps] = GetParam();
  const PeriodicBox box = Cube(1500.3, wraps, -7);
  SurfaceStream stream(In(box));
  double first_volume = 0, first_area = 0;
  for (int frame = 0; frame < 50; ++frame) {
    SCOPED_TRACE(frame);
    TrackedParticles particles{.known = known, .time = 1.0 * frame};
    particles.Add(MovedBall({-7, -7, -7}, 4), 0);
    particles.Add(MovedBall({100, 200, -7}, 5), 5000);
    const std::array<double, 3> stretch{StretchAt(frame), StretchAt(2 * frame),
                                        StretchAt(frame + 7)};
    const PeriodicBox now = Stretch(box, stretch, particles.xyz);
    const double scale = stretch[0] * stretch[1] * stretch[2];
    const std::vector<float> volumes(particles.xyz.size() / 3, static_cast<float>(scale));
    Frame view = particles.AsFrame();
    view.volumes = volumes;
    view.box = now;
    const absl::Status status = stream.Try(view);
    ASSERT_TRUE(status.ok()) << status;
    const Surface& surface = stream.surface();
    ASSERT_TRUE(Validate(surface).ok());
    std::vector<std::uint64_t> identities;
    for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
      if (surface.measures[shell].identity == 0) continue;
      identities.push_back(surface.measures[shell].identity);
    }
    std::ranges::sort(identities);
    EXPECT_THAT(identities, ::testing::ElementsAre(1, 2));
    const Sums sums = SumsOf(surface);
    if (frame == 0) first_volume = sums.volume / scale;
    if (frame == 0) first_area = sums.area / std::pow(scale, 2. / 3);
    EXPECT_NEAR(sums.volume / scale, first_volume, 2e-3 * first_volume);
    EXPECT_NEAR(sums.area / std::pow(scale, 2. / 3), first_area, 1e-2 * first_area);
    if (wraps) ExpectInBox(surface, now);
  }
}

TEST(SpaceFrameBox, BoxOfTheStreamChangesNoBit) {
  for (const bool wraps : {false, true}) {
    const PeriodicBox box = Cube(30.4, wraps, 1);
    SurfaceStream with(In(box)), without(In(box));
    for (int frame = 0; frame < 3; ++frame) {
      SpaceParticles ball = MovedBall({0, 1. * frame, 2}, 5);
      Wrap(ball.xyz, box);
      Frame view = ball.AsFrame();
      ASSERT_TRUE(without.Try(view).ok());
      view.box = box;
      ASSERT_TRUE(with.Try(view).ok());
      EXPECT_EQ(with.surface(), without.surface());
      EXPECT_EQ(with.state(), without.state());
      EXPECT_EQ(Serialize(with.state()), Serialize(without.state()));
    }
  }
}

TEST(SpaceFrameBox, WrongBoxesAreRefused) {
  const SpaceParticles ball = MovedBall({8, 8, 8}, 4);
  const auto field_of = [&](const std::optional<PeriodicBox>& of_stream, const PeriodicBox& given) {
    SurfaceParameters parameters = In(Cube(20));
    parameters.box = of_stream;
    SurfaceStream stream(parameters);
    Frame frame = ball.AsFrame();
    frame.box = given;
    const absl::Status status = stream.Try(frame);
    EXPECT_EQ(stream.state() == SurfaceState(), !status.ok());
    const auto violation = FindViolation(status);
    return violation ? violation->field : status.ToString();
  };
  EXPECT_EQ(field_of(Cube(20), Cube(21)), "OK");
  EXPECT_EQ(field_of(std::nullopt, Cube(20)), "box");
  PeriodicBox flat = Cube(20);
  flat.axes[2].reset();
  EXPECT_EQ(field_of(Cube(20), flat), "box.z");
  EXPECT_EQ(field_of(flat, Cube(20)), "box.z");
  EXPECT_EQ(field_of(Cube(20), Cube(11.99)), "box.x.length");
  EXPECT_EQ(field_of(Cube(20), Cube(std::nan(""))), "box.x.length");
}

TEST(SpaceFrameBox, StateHoldsTheBox) {
  const PeriodicBox box = Cube(60);
  SurfaceStream stream(In(box)), resumed(In(box));
  const auto next = [&](double stretch, SurfaceStream& to) {
    SpaceParticles ball = MovedBall({0, 0, 0}, 5);
    Frame view = ball.AsFrame();
    view.box = Stretch(box, {stretch, 1, 2 - stretch}, ball.xyz);
    view.positions = std::span<const double>(ball.xyz);
    EXPECT_TRUE(to.Try(view).ok());
  };
  next(1.02, stream);
  const std::string bytes = Serialize(stream.state());
  EXPECT_EQ(bytes.size(), SerializedBytes(stream.state()));
  const auto state = ParseSurfaceState(bytes);
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(*state, stream.state());
  EXPECT_TRUE(state->history.box.has_value());
  for (std::size_t k = 0; k < bytes.size(); k += 7) {
    EXPECT_FALSE(ParseSurfaceState(bytes.substr(0, k)).ok());
  }
  resumed.state() = *state;
  next(1.03, stream);
  next(1.03, resumed);
  EXPECT_EQ(stream.surface(), resumed.surface());
  EXPECT_EQ(stream.state(), resumed.state());
}

// Noise of any density in boxes that leap, wrapped or not.
TEST(SpaceFrameBox, RandomFramesKeepTheGuarantees) {
  SurfaceWorkspace workspace;
  for (std::uint64_t seed = 1; seed <= support::Tries(4u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    SurfaceParameters parameters = In(Cube(20, seed % 3 != 0));
    parameters.kernel_radius = random.Uniform(1.8, 2.5);
    if (seed % 5 == 0) parameters.placement = SurfacePlacement::kMarchingCubes;
    if (seed % 5 == 1) parameters.placement = SurfacePlacement::kQef;
    if (seed % 4 == 0) parameters.simplify = .1;
    if (seed % 7 == 0) parameters.min_component_particles = 3;
    const auto reconstructor = SurfaceReconstructor::Create(parameters);
    ASSERT_TRUE(reconstructor.ok());
    SurfaceState state;
    Surface surface;
    const double density = std::pow(10, random.Uniform(-2, -.3));
    for (int frame = 0; frame < 2; ++frame) {
      PeriodicBox box;
      double volume = 1;
      for (auto& axis : box.axes) {
        axis = PeriodicAxis{random.Uniform(-20, 20), random.Uniform(10, 14)};
        volume *= axis->length;
      }
      SpaceParticles particles;
      for (auto count = static_cast<int>(density * volume); count > 0; --count) {
        const double x = random.Uniform(-50, 50), y = random.Uniform(-50, 50);
        particles.Add({x, y, random.Uniform(-50, 50)});
      }
      Frame view = particles.AsFrame();
      view.box = box;
      const absl::Status status = reconstructor->Reconstruct(view, state, workspace, surface);
      ASSERT_TRUE(status.ok()) << status;
      const absl::Status valid = Validate(surface);
      ASSERT_TRUE(valid.ok()) << valid;
      EXPECT_LE(SumsOf(surface).particles, particles.size());
      if (parameters.box->wraps) ExpectInBox(surface, box);
    }
  }
}

}  // namespace
}  // namespace partiemc
