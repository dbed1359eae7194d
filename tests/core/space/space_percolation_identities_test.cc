// Bodies that reach their own image in a periodic box: identities, samples and resumed streams.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <vector>

#include "base/vec3.h"
#include "partiemc/partiemc.h"
#include "space/periodic_bodies.h"
#include "space/surface_stream.h"

namespace partiemc {
namespace {

using support::BoxOf;
using support::Filled;
using support::Known;
using support::Random;
using support::SpaceParticles;
using support::SurfaceStream;
using support::TrackedParticles;
using support::Wrapped;

/// A wavy layer with a cavity, and a drop above it, that drift along x and y.
constexpr double kLong = 24, kWide = 16;
TrackedParticles Drifting(Known known, int frame) {
  Random random(9);
  TrackedParticles all{.known = known, .time = 1. * frame};
  const SpaceParticles layer = Filled(24, 16, 14, .1, random, [](const Vec3& at) {
    return at.z < 11 + 2 * std::sin(2 * M_PI * at.x / kLong) && Length(at - Vec3{9, 8, 6}) > 3.2;
  });
  const Vec3 velocity{.9, -.35, 0}, shift = (1. * frame) * velocity;
  all.Add(layer, 0, velocity, shift);
  all.Add(support::Ball({18, 5, 16}, 3, .1, random), 50000, velocity, shift);
  return Wrapped(all, BoxOf(kLong, kWide, 0));
}

SurfaceParameters ForDrifting() {
  return {.placement = SurfacePlacement::kVirtualPlane,
          .kernel_radius = 2,
          .box = BoxOf(kLong, kWide, 0)};
}

class DriftingLayer : public ::testing::TestWithParam<Known> {};
INSTANTIATE_TEST_SUITE_P(With, DriftingLayer,
                         ::testing::Values(support::kNothing, support::kIds, support::kVelocities,
                                           support::kBoth),
                         ::testing::PrintToStringParamName());

TEST_P(DriftingLayer, KeepsItsIdentities) {
  SurfaceStream stream(ForDrifting());
  std::uint64_t layer = 0, drop = 0, cavity = 0;
  int with_cavity = 0;
  for (int frame = 0; frame < 100; ++frame) {
    SCOPED_TRACE(frame);
    const Surface& surface = stream.Next(Drifting(GetParam(), frame));
    if (frame % 10 == 0) {
      ASSERT_TRUE(Validate(surface).ok());
    }
    std::vector<std::size_t> by_volume(surface.ShellCount());
    std::iota(by_volume.begin(), by_volume.end(), std::size_t{0});
    std::ranges::sort(by_volume, std::greater(),
                      [&](std::size_t k) { return surface.measures[k].volume; });
    // The layer, the drop, and the cavity if it crosses no face.
    ASSERT_GE(surface.ShellCount(), 2u);
    ASSERT_LE(surface.ShellCount(), 3u);
    const auto identity = [&](std::size_t k) { return surface.measures[by_volume[k]].identity; };
    if (frame == 0) layer = identity(0), drop = identity(1), cavity = identity(2);
    EXPECT_EQ(identity(0), layer);
    EXPECT_EQ(identity(1), drop);
    for (std::size_t k = 0; k < 2 && frame > 0; ++k) {
      const auto parents = surface.ParentsOf(by_volume[k]);
      ASSERT_EQ(parents.size(), 1u);
      EXPECT_EQ(parents[0], identity(k));
    }
    const ShellHistory& history = stream.state().history;
    EXPECT_EQ(history.shells.size(), surface.ShellCount());
    std::uint64_t nodes = 0;  // Of the layer.
    for (const ShellRun& run : history.runs) {
      if (history.shells[run.shell].identity != layer) continue;
      nodes += static_cast<std::uint64_t>(run.last - run.first) + 1;
    }
    EXPECT_NEAR(static_cast<double>(nodes) / surface.measures[by_volume[0]].volume, 1, .1);
    if (surface.ShellCount() < 3) continue;
    ++with_cavity;
    EXPECT_NE(identity(2), 0u);
    if (frame < 10) {
      EXPECT_EQ(identity(2), cavity);
    }
  }
  EXPECT_GT(with_cavity, 20);
  EXPECT_LT(with_cavity, 100);
}

// A drop across a face has all its particles, copies included.
TEST(PercolatingIdentities, SamplesOfADropAcrossAFaceAreAllItsParticles) {
  Random random(13);
  const PeriodicBox box = BoxOf(kLong, kWide, 0);
  TrackedParticles all{.known = support::kIds};
  all.Add(Filled(24, 16, 5, 0, random, [](const Vec3&) { return true; }), 100);
  all.Add(support::Box({-1, 7, 8}, {1, 8, 9}, 0, random), 0);  // Twelve particles.
  all = Wrapped(all, box);
  SurfaceStream stream(ForDrifting());
  const Surface& surface = stream.Next(all);
  ASSERT_EQ(surface.ShellCount(), 2u);
  const ShellHistory& history = stream.state().history;
  std::vector<int> samples(2);
  for (const ShellSample& sample : history.samples) ++samples[sample.shell];
  std::ranges::sort(samples);
  EXPECT_EQ(samples, (std::vector<int>{12, 16}));
}

TEST(PercolatingIdentities, ResumedStreamsHaveTheSameBits) {
  SurfaceStream whole(ForDrifting()), resumed(ForDrifting());
  for (int frame = 0; frame < 6; ++frame) {
    const Surface& expected = whole.Next(Drifting(support::kBoth, frame));
    const Surface& surface = resumed.Next(Drifting(support::kBoth, frame));
    EXPECT_EQ(surface, expected);
    const auto again = ParseSurfaceState(Serialize(resumed.state()));
    ASSERT_TRUE(again.ok()) << again.status();
    resumed.state() = *again;
  }
}

}  // namespace
}  // namespace partiemc
