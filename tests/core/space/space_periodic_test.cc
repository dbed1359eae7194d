// Periodic boxes in space: surfaces are those of the same bodies in the middle of the box.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "space/periodic_bodies.h"
#include "space/surface_of.h"
#include "space/surface_stream.h"

namespace partiemc {
namespace {

using support::Cube;
using support::In;
using support::Known;
using support::Random;
using support::SpaceParticles;
using support::SurfaceOf;
using support::SurfaceStream;
using support::TrackedParticles;
using support::Wrap;

SpaceParticles ShakenBallAt(const Vec3& centre, double radius) {
  Random random(1);
  return support::Ball(centre, radius, .2, random);
}

class PeriodicSurface : public ::testing::TestWithParam<SurfacePlacement> {};
INSTANTIATE_TEST_SUITE_P(Placements, PeriodicSurface,
                         ::testing::Values(SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                           SurfacePlacement::kVirtualPlane));

TEST_P(PeriodicSurface, BallAcrossFaceEdgeAndCornerIsTheBallInTheMiddle) {
  const PeriodicBox box = Cube(32);
  const Surface middle = SurfaceOf(ShakenBallAt({16, 16, 16}, 6), {.placement = GetParam()});
  ASSERT_EQ(middle.ShellCount(), 1u);
  for (const Vec3& centre : {Vec3{0, 16, 16}, {16, 0, 0}, {0, 0, 0}, {31, 31, 2}}) {
    SpaceParticles ball = ShakenBallAt({16, 16, 16}, 6);
    for (std::size_t k = 0; k < ball.xyz.size(); ++k) {
      ball.xyz[k] += std::array{centre.x, centre.y, centre.z}[k % 3] - 16;
    }
    Wrap(ball.xyz, box);
    const Surface across = SurfaceOf(ball, In(box, GetParam()));
    ASSERT_EQ(across.ShellCount(), 1u);
    EXPECT_TRUE(Validate(across).ok()) << Validate(across);
    const ShellMeasures &is = across.measures[0], &wanted = middle.measures[0];
    EXPECT_NEAR(is.volume, wanted.volume, 1e-6 * wanted.volume);
    EXPECT_NEAR(is.area, wanted.area, 1e-6 * wanted.area);
    EXPECT_EQ(is.particles, wanted.particles);
    // Cut by the faces, it has more shells.
    EXPECT_GT(SurfaceOf(ball, {.placement = GetParam()}).ShellCount(), 1u);
  }
}

TEST(PeriodicSpace, ThreadsAndOrderChangeNoBit) {
  const PeriodicBox box = Cube(48.5);
  Random random(4);
  SpaceParticles all = ShakenBallAt({1, 2, 3}, 6);
  all.Add(ShakenBallAt({24, 1, 24}, 4));
  all.Add(ShakenBallAt({20, 24, 47}, 5));
  Wrap(all.xyz, box);
  const SurfaceParameters parameters = In(box, SurfacePlacement::kVirtualPlane);
  const Surface first = SurfaceOf(all, parameters);
  ASSERT_EQ(first.ShellCount(), 3u);
  EXPECT_EQ(SurfaceOf(support::Shuffled(all, random), parameters), first);
  Arena arena(2);
  arena.Execute([&] { EXPECT_EQ(SurfaceOf(all, parameters), first); });
}

// A hollow ball and a ball that cross the faces.
TrackedParticles Crossing(Known known, int frame) {
  TrackedParticles all{.known = known, .time = 1.0 * frame};
  const SpaceParticles full = ShakenBallAt({0, 0, 0}, 8);
  SpaceParticles hollow;
  for (std::size_t k = 0; k < full.size(); ++k) {
    if (Length(full.At(k)) > 4) hollow.Add(full.At(k));
  }
  const Vec3 a{.9, -.8, .7}, b{-.6, -.8, .7};
  all.Add(hollow, 0, a, Vec3{20, 20, 20} + (1.0 * frame) * a);
  all.Add(ShakenBallAt({0, 0, 0}, 3), 5000, b, Vec3{20, 45, 45} + (1.0 * frame) * b);
  return all;
}

class CrossingShells : public ::testing::TestWithParam<Known> {};
INSTANTIATE_TEST_SUITE_P(With, CrossingShells,
                         ::testing::Values(support::kNothing, support::kIds, support::kVelocities,
                                           support::kBoth),
                         ::testing::PrintToStringParamName());

TEST_P(CrossingShells, KeepTheirIdentitiesForHundredFrames) {
  const PeriodicBox box{
      .axes = {PeriodicAxis{-5, 50.3}, PeriodicAxis{4, 52.7}, PeriodicAxis{0, 51}}};
  SurfaceStream stream(In(box, SurfacePlacement::kMarchingCubes));
  std::vector<std::uint64_t> first;
  for (int frame = 0; frame < 100; ++frame) {
    SCOPED_TRACE(frame);
    TrackedParticles particles = Crossing(GetParam(), frame);
    Wrap(particles.xyz, box);
    const Surface& surface = stream.Next(particles);
    ASSERT_EQ(surface.ShellCount(), 3u);
    std::vector<std::uint64_t> identities;
    for (const ShellMeasures& shell : surface.measures) identities.push_back(shell.identity);
    std::ranges::sort(identities);
    if (frame == 0) first = identities;
    EXPECT_EQ(identities, first);
  }
}

// More of such bodies: space_percolation_test.cc.
TEST(PeriodicSpace, BodyThatReachesItsOwnImageIsCut) {
  Random random(2);
  const auto cuts = [&](const Vec3& low, const Vec3& high) {
    const SpaceParticles body = support::Box(low, high, 0, random);
    const Surface surface = SurfaceOf(body, In(Cube(30), SurfacePlacement::kMarchingCubes));
    EXPECT_EQ(surface.ShellCount(), 1u);
    EXPECT_EQ(surface.measures[0].particles, body.size());
    return surface.cuts.size();
  };
  EXPECT_GT(cuts({0, 0, 10}, {29, 29, 14}), 0u);
  EXPECT_GT(cuts({10, 10, 0}, {14, 14, 29}), 0u);
  EXPECT_EQ(cuts({10, 10, 0}, {14, 14, 22}), 0u);
}

TEST(PeriodicSpace, WrongBoxesAreRefused) {
  const auto field_of = [](const PeriodicBox& box) {
    const auto status = SurfaceReconstructor::Create(In(box, SurfacePlacement::kQef)).status();
    const auto violation = FindViolation(status);
    return violation ? violation->field : status.ToString();
  };
  for (const double length : {0.0, -1.0, 11.99, 1.1e8, std::nan("")}) {
    EXPECT_EQ(field_of(Cube(length)), "parameters.box.x.length");
  }
  EXPECT_EQ(field_of({}), "parameters.box");
  EXPECT_EQ(field_of(Cube(12)), "OK");
}

// A row of particles crosses the box, and only copies of them lie beyond the lattice. The error
// names the caller's particle.
TEST(PeriodicSpace, FarCopyIsReportedAsItsParticle) {
  constexpr double kEnd = 0x1p30;  // Of the lattice, in cells.
  PeriodicBox box;
  box.axes[0] = PeriodicAxis{kEnd - 16, 12};
  SpaceParticles row;
  for (int k = 0; k < 12; ++k) row.Add(Vec3{kEnd - 16 + k, 0, 0});
  const auto reconstructor = SurfaceReconstructor::Create(In(box, SurfacePlacement::kQef));
  ASSERT_TRUE(reconstructor.ok()) << reconstructor.status();
  SurfaceWorkspace workspace;
  Surface surface;
  const auto violation =
      FindViolation(reconstructor->Reconstruct(row.AsFrame(), workspace, surface));
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->reason, kReasonOutOfRange);
  EXPECT_EQ(violation->field, "positions[4].x");
}

// Through Reconstructor, as streams do.
TEST(PeriodicSpace, StreamOfSurfacesHasTheBox) {
  const PeriodicBox box = Cube(32);
  ReconstructionParameters parameters{.output = Output::kSurface, .spacing = 1.0, .box = box};
  SpaceParticles ball = ShakenBallAt({0, 0, 0}, 6);
  Wrap(ball.xyz, box);
  State state;
  Workspace workspace;
  Result result;
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok()) << reconstructor.status();
  ASSERT_TRUE(reconstructor->Reconstruct(ball.AsFrame(), state, workspace, result).ok());
  EXPECT_EQ(result.surface.ShellCount(), 1u);
  // A section cuts only one image.
  parameters.sections.push_back({.slice = SlicePlane{}});
  EXPECT_EQ(FindViolation(Validate(parameters))->field, "parameters.sections[0].slice");
}

}  // namespace
}  // namespace partiemc
