// The noise filter of surfaces and slices (core/NOISE.md).
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "base/vec3.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "space/space_particles.h"
#include "support/motion_oracle.h"
#include "support/noisy_particles.h"
#include "support/random.h"
#include "support/result_stream.h"

namespace partiemc::support {
namespace {

using support::LargestOffset;
using support::Random;

ReconstructionParameters Filtering(double weight = .5) {
  return {.output = Output::kSurface, .spacing = 1.0, .noise_filter = weight};
}

struct Numbered {
  SpaceParticles particles;
  std::vector<std::uint64_t> ids;

  Frame AsFrame() const {
    Frame frame = particles.AsFrame();
    frame.ids = ids;
    return frame;
  }
};

// A ball that moves; `shake` is the largest noise along each axis.
Numbered NumberedBall(const Vec3& centre, double radius, double shake, Random& random) {
  Numbered ball{Ball({}, radius, 0, random), {}};
  const std::array<double, 3> shift{centre.x, centre.y, centre.z};
  std::vector<double>& xyz = ball.particles.xyz;
  for (std::size_t k = 0; k < xyz.size(); ++k) {
    xyz[k] += shift[k % 3] + random.Uniform(-shake, shake);
  }
  for (std::size_t k = 0; k < ball.particles.size(); ++k) ball.ids.push_back(3 * k);
  return ball;
}

Numbered Permuted(const Numbered& given, Random& random) {
  Numbered all = given;
  for (std::size_t k = all.ids.size(); k > 1; --k) {
    const std::size_t other = random.Below(k);
    std::swap(all.ids[k - 1], all.ids[other]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::swap(all.particles.xyz[3 * (k - 1) + axis], all.particles.xyz[3 * other + axis]);
    }
  }
  return all;
}

TEST(SpaceNoiseFilter, EqualsBruteForce) {
  for (const bool is_periodic : {false, true}) {
    SCOPED_TRACE(is_periodic);
    ReconstructionParameters parameters = Filtering();
    support::FilterOracle oracle{.axes = 3};
    if (is_periodic) {
      parameters.box = PeriodicBox{
          .axes = {PeriodicAxis{-7, 18.2}, PeriodicAxis{-14, 21}, PeriodicAxis{0, 16.5}}};
      oracle.box = parameters.box;
    }
    ResultStream stream(parameters);
    Random random(3);
    for (int frame = 0; frame < 4; ++frame) {
      const Numbered ball =
          Permuted(NumberedBall({1. * frame, -.5 * frame, .3 * frame}, 4.5, .2, random), random);
      stream.Next(ball.AsFrame());
      std::vector<Vec3> at;
      for (std::size_t k = 0; k < ball.ids.size(); ++k) at.push_back(ball.particles.At(k));
      oracle.Next(ball.ids, at);
      ASSERT_EQ(stream.state.noise.ids.size(), ball.ids.size());
      for (std::size_t rank = 0; rank < ball.ids.size(); ++rank) {
        const Vec3 expected = oracle.known.at(stream.state.noise.ids[rank]).offset;
        EXPECT_NEAR(stream.state.noise.offsets[3 * rank], expected.x, 1e-6);
        EXPECT_NEAR(stream.state.noise.offsets[3 * rank + 1], expected.y, 1e-6);
        EXPECT_NEAR(stream.state.noise.offsets[3 * rank + 2], expected.z, 1e-6);
      }
    }
    EXPECT_GT(LargestOffset(stream.state), .05);
  }
}

TEST(SpaceNoiseFilter, WeightOneKeepsBitsAndSectionsAreThoseOfSlices) {
  ReconstructionParameters with = Filtering();
  with.sections = {{.slice = SlicePlane{}}, {.slice = SlicePlane{}, .isovalue = .3}};
  ReconstructionParameters sliced = with;
  sliced.output = Output::kOutline;
  sliced.slice = SlicePlane{};
  sliced.sections.erase(sliced.sections.begin());
  ReconstructionParameters plain = with, given = with;
  plain.noise_filter.reset();
  given.noise_filter = 1;
  ResultStream surfaces(with), slices(sliced), off(plain), one(given);
  Random random(4);
  for (int frame = 0; frame < 3; ++frame) {
    const Numbered ball = NumberedBall({.4 * frame, 0, 0}, 6, .2, random);
    const Result& filtered = surfaces.Next(ball.AsFrame());
    const Result& slice = slices.Next(ball.AsFrame());
    ASSERT_EQ(filtered.sections.size(), 2u);
    EXPECT_EQ(filtered.sections[0].rings, slice.rings);
    EXPECT_EQ(filtered.sections[1].rings, slice.sections[0].rings);
    EXPECT_EQ(surfaces.state.noise, slices.state.noise);
    const Result& unfiltered = off.Next(ball.AsFrame());
    EXPECT_EQ(one.Next(ball.AsFrame()), unfiltered);
    EXPECT_EQ(filtered.surface == unfiltered.surface, frame == 0);
  }
}

TEST(SpaceNoiseFilter, CoarsePositionsAreReported) {
  Random random(4);
  const Numbered ball = NumberedBall({4e6, 0, 0}, 6, 0, random);
  const std::vector<float> coarse(ball.particles.xyz.begin(), ball.particles.xyz.end());
  Frame frame = ball.AsFrame();
  frame.positions = std::span<const float>(coarse);
  ResultStream surfaces(Filtering());
  for (int k = 0; k < 2; ++k) {
    const Result& result = surfaces.Next(frame);
    EXPECT_TRUE(result.statistics.doubts.Has(Doubt::kPositionsCoarse));
    EXPECT_EQ(result.surface.statistics.doubts, result.statistics.doubts);
  }
}

TEST(SpaceNoiseFilter, OrderAndThreadsChangeNoBit) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 5);
  Random random(5);
  std::vector<Numbered> frames;
  for (int k = 0; k < 3; ++k) frames.push_back(NumberedBall({.4 * k, 0, 0}, 12, .2, random));
  ResultStream stream(Filtering());
  Result last;
  Arena one(1);
  one.Execute([&] {
    for (const Numbered& frame : frames) last = stream.Next(frame.AsFrame());
  });
  Arena five(5);
  five.Execute([&] {
    ResultStream other(Filtering());
    for (const Numbered& frame : frames) {
      const Result& result = other.Next(Permuted(frame, random).AsFrame());
      if (&frame == &frames.back()) {
        EXPECT_EQ(result, last);
      }
    }
    EXPECT_EQ(other.state, stream.state);
  });
}

TEST(SpaceNoiseFilter, ResumesFromItsBytesAndRefusedFramesChangeNothing) {
  ReconstructionParameters parameters = Filtering();
  parameters.sections = {{.slice = SlicePlane{}}};
  ResultStream undisturbed(parameters), resumed(parameters);
  Random random(6);
  for (int frame = 0; frame < 5; ++frame) {
    const Numbered ball = NumberedBall({.4 * frame, 0, 0}, 5, .2, random);
    const Result& expected = undisturbed.Next(ball.AsFrame());
    const std::string bytes = Serialize(resumed.state);
    EXPECT_EQ(bytes.size(), SerializedBytes(resumed.state));
    auto parsed = ParseState(bytes);
    ASSERT_TRUE(parsed.ok()) << parsed.status();
    EXPECT_EQ(*parsed, resumed.state);
    resumed.state = *std::move(parsed);
    Numbered broken = ball;
    broken.ids.clear();
    const auto violation = FindViolation(resumed.Try(broken.AsFrame()));
    ASSERT_TRUE(violation);
    EXPECT_EQ(violation->field, "ids");
    EXPECT_EQ(Serialize(resumed.state), bytes);
    EXPECT_EQ(resumed.Next(ball.AsFrame()), expected);
  }
  EXPECT_EQ(resumed.state, undisturbed.state);
}

// The distance of a surface from `centre` along a direction: where the ray meets a triangle.
double RadiusAlong(const Surface& surface, const Vec3& centre, const Vec3& direction) {
  for (std::size_t k = 0; k < surface.TriangleCount(); ++k) {
    const auto corner = [&](std::size_t c) {
      return Vec3At(surface.points, surface.triangles[3 * k + c]) - centre;
    };
    const Vec3 a = corner(0), b = corner(1), c = corner(2);
    const double u = Dot(direction, Cross(b, c)), v = Dot(direction, Cross(c, a)),
                 w = Dot(direction, Cross(a, b));
    if (u < 0 || v < 0 || w < 0 || u + v + w == 0) continue;
    const Vec3 hit = (1 / (u + v + w)) * (u * a + v * b + w * c);
    return Dot(hit, direction);
  }
  ADD_FAILURE() << "the surface has a gap";
  return 0;
}

TEST(SpaceNoiseFilter, JitterOfABallFalls) {
  constexpr int kFrames = 26, kSettled = 6;
  Random random(7);
  std::vector<Vec3> directions;
  for (int k = 0; k < 60; ++k) {
    directions.push_back(
        Normalised({random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)}));
  }
  for (const double motion : {0.0, .4}) {
    ResultStream filtered(Filtering()), plain({.output = Output::kSurface, .spacing = 1.0});
    std::vector<std::array<double, 2>> sums(60), squares(60), last(60);
    std::array<double, 2> steps{}, positions{};
    double volumes = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      const Vec3 centre{motion * frame, 0, 0};
      const Numbered ball = NumberedBall(centre, 8, .25, random);
      const Surface& given = plain.Next(ball.AsFrame()).surface;
      const Surface& smooth = filtered.Next(ball.AsFrame()).surface;
      volumes += smooth.measures[0].volume / given.measures[0].volume / kFrames;
      for (std::size_t k = 0; k < 60 && frame >= kSettled; ++k) {
        const std::array<double, 2> radii{RadiusAlong(smooth, centre, directions[k]),
                                          RadiusAlong(given, centre, directions[k])};
        for (std::size_t which = 0; which < 2; ++which) {
          sums[k][which] += radii[which];
          squares[k][which] += radii[which] * radii[which];
          if (frame > kSettled) steps[which] += std::pow(radii[which] - last[k][which], 2);
        }
        last[k] = radii;
      }
    }
    constexpr double kCount = kFrames - kSettled;
    for (std::size_t k = 0; k < 60; ++k) {
      for (std::size_t which = 0; which < 2; ++which) {
        positions[which] += squares[k][which] - sums[k][which] * sums[k][which] / kCount;
      }
    }
    const double position = std::sqrt(positions[0] / positions[1]);
    const double step = std::sqrt(steps[0] / steps[1]);
    std::printf("ball, noise .144 h, motion %.1f h: position %.3f, step %.3f, volume %.5f\n",
                motion, position, step, volumes);
    EXPECT_LT(position, .70);
    EXPECT_LT(step, .60);
    EXPECT_NEAR(volumes, 1, .002);
  }
}

TEST(SpaceNoiseFilter, RigidMotionDoesNotLagAndPulsationHardlyDoes) {
  for (const bool pulses : {false, true}) {
    ResultStream stream(Filtering());
    Random random(8);
    for (int frame = 0; frame < 40; ++frame) {
      Numbered ball = NumberedBall({}, 8, 0, random);
      for (double& at : ball.particles.xyz) {
        at = pulses ? at * (1 + std::sin(frame * .314159265) / 8) : at + .4 * frame;
      }
      stream.Next(ball.AsFrame());
      EXPECT_LT(LargestOffset(stream.state), pulses ? .03 : 1e-6);
    }
  }
}

}  // namespace
}  // namespace partiemc::support
