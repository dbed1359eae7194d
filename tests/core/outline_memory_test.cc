// The memory of the outline, through the whole method: what it is to do, what it is not to touch.
#include "outline_memory.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "partiemc/validate.h"
#include "support/instruction_sets.h"
#include "support/ring_stream.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using support::RingStream;

constexpr ReconstructionParameters kForgetful{.outline_memory = false};

Particles WithIds(Particles particles, std::uint64_t first = 0) {
  particles.ids.clear();
  for (std::size_t k = 0; k < particles.size(); ++k) particles.ids.push_back(first + k);
  return particles;
}

// Every particle displaced by up to `noise` along each axis.
Particles Shaken(Particles particles, double noise, Random& random) {
  for (double& coordinate : particles.xy) coordinate += random.Uniform(-noise, noise);
  return particles;
}

Particles Turned(Particles particles, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double x = particles.x(k), y = particles.y(k);
    particles.xy[2 * k] = c * x - s * y;
    particles.xy[2 * k + 1] = s * x + c * y;
  }
  return particles;
}

// A stirred body of few hundred particles: they keep their ids, it turns, drifts and is strained.
Particles Stirred(int frame, bool ids = true) {
  Random random(5);
  Particles body = support::Annulus(3, 10);
  body = Shaken(body, 0.2, random);
  for (std::size_t k = 0; k < body.size(); ++k) body.xy[2 * k] *= 1 + 0.01 * frame;
  Random noise(100 + frame);
  body = support::Shifted(Turned(Shaken(body, 0.05, noise), 0.07 * frame), 0.4 * frame, 0.15);
  return ids ? WithIds(body) : body;
}

double DistanceToSegment(double x, double y, const double* a, const double* b) {
  const double ux = b[0] - a[0], uy = b[1] - a[1];
  const double share =
      std::clamp(((x - a[0]) * ux + (y - a[1]) * uy) / (ux * ux + uy * uy), 0.0, 1.0);
  return std::hypot(x - a[0] - share * ux, y - a[1] - share * uy);
}

double DistanceToRings(double x, double y, const Rings& rings) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const auto points = rings.RingPoints(ring);
    for (std::size_t k = 0, before = points.size() - 2; k < points.size(); before = k, k += 2) {
      nearest = std::min(nearest, DistanceToSegment(x, y, &points[before], &points[k]));
    }
  }
  return nearest;
}

// Of the points of `a` to the rings of `b`: mean and largest distance.
struct Deviation {
  double mean = 0, largest = 0;
};
Deviation DeviationOf(const Rings& a, const Rings& b) {
  Deviation deviation;
  for (std::size_t k = 0; k < a.PointCount(); ++k) {
    const double distance = DistanceToRings(a.points[2 * k], a.points[2 * k + 1], b);
    deviation.mean += distance / static_cast<double>(a.PointCount());
    deviation.largest = std::max(deviation.largest, distance);
  }
  return deviation;
}

// `rings` as they were before the body was shifted, then turned about the origin.
Rings TakenBack(Rings rings, double angle, double dx, double dy) {
  const double c = std::cos(angle), s = std::sin(angle);
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    const double x = rings.points[2 * k] - dx, y = rings.points[2 * k + 1] - dy;
    rings.points[2 * k] = c * x + s * y;
    rings.points[2 * k + 1] = c * y - s * x;
  }
  return rings;
}

void ExpectSame(const RingStream& a, const RingStream& b) {
  EXPECT_EQ(a.result(), b.result());
  EXPECT_EQ(a.state(), b.state());
}

TEST(OutlineMemory, WithoutIdsThereIsNone) {
  RingStream with, without(kForgetful);
  for (int frame = 0; frame < 5; ++frame) {
    with.Next(Stirred(frame, false));
    without.Next(Stirred(frame, false));
    ExpectSame(with, without);
    EXPECT_EQ(with.state().outline, KnownOutline());
  }
}

TEST(OutlineMemory, SwitchedOffOrOfOtherPlacementsIsEmpty) {
  for (const Placement placement : AllPlacements()) {
    const bool has_memory = placement == Placement::kVirtualPlane;
    RingStream with({.placement = placement}),
        without({.placement = placement, .outline_memory = false});
    for (int frame = 0; frame < 3; ++frame) {
      with.Next(Stirred(frame));
      without.Next(Stirred(frame));
      EXPECT_EQ(without.state().outline, KnownOutline());
      EXPECT_EQ(with.state().outline != KnownOutline(), has_memory);
      EXPECT_EQ(with.rings().points != without.rings().points, has_memory && frame > 0);
    }
    // A state with an outline, as of another stream: it is not kept.
    RingStream memory;
    memory.Next(Stirred(0));
    without.state().outline = memory.state().outline;
    without.Next(Stirred(3));
    EXPECT_EQ(without.state().outline, KnownOutline());
  }
}

TEST(OutlineMemory, HoldsTheRingsAndTheParticlesNearThem) {
  RingStream stream;
  const Particles body = WithIds(support::Disc(12, 100, -30), 7);
  const Rings rings = stream.Next(body);
  const KnownOutline& outline = stream.state().outline;
  EXPECT_EQ(outline.offsets, rings.offsets);
  EXPECT_EQ(outline.points.size(), rings.points.size());
  ASSERT_FALSE(outline.particles.empty());
  EXPECT_LT(outline.particles.size(), body.size());
  EXPECT_TRUE(std::is_sorted(outline.particles.begin(), outline.particles.end(),
                             [](const auto& a, const auto& b) { return a.hash < b.hash; }));
  // All that is within two spacings is there.
  for (std::size_t k = 0; k < body.size(); ++k) {
    if (DistanceToRings(body.x(k), body.y(k), rings) > 2) continue;
    EXPECT_TRUE(std::any_of(
        outline.particles.begin(), outline.particles.end(),
        [&](const NearParticle& near) { return near.x == body.x(k) && near.y == body.y(k); }));
  }
}

TEST(OutlineMemory, OfParticlesThatAreAllNewSaysNothing) {
  RingStream with, without(kForgetful);
  for (int frame = 0; frame < 4; ++frame) {
    const Particles particles =
        WithIds(Stirred(frame), 1'000'000 * static_cast<std::uint64_t>(frame));
    with.Next(particles);
    without.Next(particles);
    EXPECT_EQ(with.result(), without.result());
    EXPECT_NE(with.state().outline, KnownOutline());
  }
}

TEST(OutlineMemory, IsForgottenByAFrameWithoutIdsOrParticles) {
  for (const Particles& between : {Stirred(2, false), Particles()}) {
    RingStream with, without(kForgetful);
    for (int frame = 0; frame < 2; ++frame) {
      with.Next(Stirred(frame));
      without.Next(Stirred(frame));
    }
    EXPECT_NE(with.rings().points, without.rings().points);
    with.Next(between);
    EXPECT_EQ(with.state().outline, KnownOutline());
    // The offset of the areas is another memory, of all frames.
    without.Next(between);
    without.state().area_offset = with.state().area_offset;
    with.Next(Stirred(3));
    without.Next(Stirred(3));
    EXPECT_EQ(with.rings().points, without.rings().points);
  }
}

TEST(OutlineMemory, IsLeftAsItWasByARefusedFrame) {
  RingStream stream;
  stream.Next(Stirred(0));
  const State before = stream.state();
  Particles twice = Stirred(1);
  twice.ids[7] = twice.ids[3];
  Particles infinite = Stirred(1);
  infinite.xy[5] = std::numeric_limits<double>::quiet_NaN();
  Particles far = Stirred(1);
  far.xy[5] = 1e12;
  for (const Particles& bad : {twice, infinite, far}) {
    EXPECT_FALSE(stream.Try(bad).ok());
    EXPECT_EQ(stream.state(), before);
  }
}

// How much the outline of an uneven bar changes from frame to frame, seen from the bar, while it
// leaps and turns in front of the lattice: by nothing, were there no lattice.
double JitterOfLeapingBar(const ReconstructionParameters& parameters) {
  Random random(8);
  const Particles bar = WithIds(Shaken(support::Lattice(30, 12, -15, -6), 0.15, random));
  RingStream stream(parameters);
  Rings last;
  double sum = 0;
  constexpr int kFrames = 20, kSettled = 5;
  for (int frame = 0; frame < kFrames; ++frame) {
    const double angle = 0.2 * frame, dx = 30.3 * frame, dy = -17.1 * frame;
    stream.Next(support::Shifted(Turned(bar, angle), dx, dy));
    const Rings now = TakenBack(stream.rings(), angle, dx, dy);
    if (frame >= kSettled) sum += DeviationOf(now, last).mean / (kFrames - kSettled);
    last = now;
  }
  return sum;
}

TEST(OutlineMemory, CalmsARigidBodyThatLeapsAndTurns) {
  struct Case {
    double cell_size, kernel_radius, ratio;
  };
  // Narrow kernels and large cells see most of the lattice. Where hardly anything of it is seen,
  // there is nothing to calm, and nothing is stirred up.
  for (const auto& [cell_size, kernel_radius, ratio] : {Case{0.25, 1.5, 0.8},
                                                        {1, 1.5, 0.75},
                                                        {2, 1.5, 0.75},
                                                        {2, 3, 0.85},
                                                        {4, 3, 0.9},
                                                        {4, 8, 0.9},
                                                        {0.25, 3, 1.01},
                                                        {0.25, 8, 1.01},
                                                        {1, 3, 0.95},
                                                        {1, 8, 1}}) {
    ReconstructionParameters parameters{.kernel_radius = kernel_radius, .cell_size = cell_size};
    const double with = JitterOfLeapingBar(parameters);
    parameters.outline_memory = false;
    EXPECT_LT(with, ratio * JitterOfLeapingBar(parameters))
        << "cells " << cell_size << ", kernel " << kernel_radius;
  }
}

// How much the outline of a disc changes from frame to frame whose particles are shaken anew in
// each.
double JitterOfShakenDisc(double noise, bool memory) {
  const Particles disc = support::Disc(12, 0.3, 0.1);
  RingStream stream({.outline_memory = memory});
  Random random(4);
  Rings last;
  double sum = 0;
  constexpr int kFrames = 30, kSettled = 5;
  for (int frame = 0; frame < kFrames; ++frame) {
    const Rings& rings = stream.Next(WithIds(Shaken(disc, noise, random)));
    if (frame >= kSettled) sum += DeviationOf(rings, last).mean / (kFrames - kSettled);
    last = rings;
  }
  return sum;
}

// What all particles near a point do by chance is taken for motion: the outline goes along.
TEST(OutlineMemory, OfParticlesThatTrembleFollowsThemNotMuchMoreThanTheirFieldDoes) {
  EXPECT_LT(JitterOfShakenDisc(0.02, true), 1.45 * JitterOfShakenDisc(0.02, false));
  EXPECT_LT(JitterOfShakenDisc(0.15, true), 1.05 * JitterOfShakenDisc(0.15, false));
}

TEST(OutlineMemory, LosesNoAreaInManyFrames) {
  for (const double radius : {0.5, 1.5, 3.0, 12.0}) {
    for (const double turn : {0.0, 0.05}) {
      for (const double noise : {0.0, 0.1}) {
        // Without the step that makes areas right in the end.
        ReconstructionParameters parameters{.steps = {.area = false}};
        RingStream with(parameters);
        parameters.outline_memory = false;
        RingStream without(parameters);
        Random random(3);
        double sum_with = 0, sum_without = 0, largest = 0;
        for (int frame = 0; frame < 200; ++frame) {
          const Particles body = WithIds(support::Shifted(
              Turned(Shaken(support::Disc(radius), noise, random), turn * frame), 0.13 * frame, 0));
          with.Next(body);
          without.Next(body);
          ASSERT_EQ(with.rings().RingCount(), without.rings().RingCount());
          if (frame < 100) continue;
          sum_with += with.result().statistics.area;
          sum_without += without.result().statistics.area;
          largest = std::max(largest, DeviationOf(with.rings(), without.rings()).largest);
        }
        EXPECT_NEAR(sum_with / sum_without, 1, 0.005)
            << "radius " << radius << ", turn " << turn << ", noise " << noise;
        EXPECT_LT(largest, 0.25);
      }
    }
  }
}

TEST(OutlineMemory, OfARingThatVanishesDoesNotComeBackWithIt) {
  RingStream with, without(kForgetful);
  const Particles body = support::Disc(8);
  Particles drop = support::Disc(2, 30, 0);
  const auto frame = [&](bool has_drop, double x) {
    Particles particles = body;
    if (has_drop) particles.Add(support::Shifted(drop, x, 0));
    return WithIds(particles);
  };
  for (int k = 0; k < 3; ++k) with.Next(frame(true, 0.2 * k));
  for (int k = 0; k < 2; ++k) with.Next(frame(false, 0));
  for (const double coordinate : with.state().outline.points) EXPECT_LT(coordinate, 20);
  with.Next(frame(true, 0.6));
  without.Next(frame(true, 0.6));
  const auto drop_of = [](const RingStream& stream) {
    const auto points = stream.rings().RingPoints(stream.Ring(30, 0));
    return std::vector(points.begin(), points.end());
  };
  ASSERT_EQ(drop_of(with).size(), drop_of(without).size());
  for (std::size_t k = 0; k < drop_of(with).size(); ++k) {
    EXPECT_NEAR(drop_of(with)[k], drop_of(without)[k], 0.05);  // But for the areas' offset.
  }
}

TEST(OutlineMemory, RestartsThreadsAndInstructionSetsChangeNoBit) {
  RingStream expected;
  std::vector<Result> results;
  std::vector<std::string> states;
  for (int frame = 0; frame < 4; ++frame) {
    states.push_back(Serialize(expected.state()));
    expected.Next(Stirred(frame));
    results.push_back(expected.result());
  }
  const auto expect_same = [&] {
    for (int restart = 0; restart < 4; ++restart) {
      RingStream restored;
      restored.state() = *ParseState(states[static_cast<std::size_t>(restart)]);
      for (int frame = restart; frame < 4; ++frame) {
        restored.Next(Stirred(frame));
        EXPECT_EQ(restored.result(), results[static_cast<std::size_t>(frame)]);
      }
      EXPECT_EQ(restored.state(), expected.state());
    }
  };
  EXPECT_GT(support::ForEachInstructionSet(expect_same), 1);
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
    tbb::task_arena arena(threads);
    arena.execute(expect_same);
  }
}

TEST(OutlineMemory, AnotherOrderOfParticlesChangesRoundingOnly) {
  RingStream stream, permuted;
  Random random(6);
  for (int frame = 0; frame < 10; ++frame) {
    const Rings& expected = stream.Next(Stirred(frame));
    const Rings& other = permuted.Next(support::Permuted(Stirred(frame), random));
    ASSERT_EQ(other.offsets, expected.offsets);
    for (std::size_t k = 0; k < expected.points.size(); ++k) {
      EXPECT_NEAR(other.points[k], expected.points[k], 1e-3);
    }
  }
}

TEST(OutlineMemory, HoldsForSpacingsThatAreEstimatedInEachFrame) {
  const auto reconstructor = Reconstructor::Create({.spacing_rule = SpacingRule::kEveryFrame});
  ASSERT_TRUE(reconstructor.ok());
  State state;
  Workspace workspace;
  Result result;
  for (int frame = 0; frame < 12; ++frame) {
    // It grows to three times its spacing and shrinks again.
    const double factor = 1 + 2 * std::sin(frame * 0.3);
    const Particles body = support::Scaled(Stirred(frame), std::abs(factor) + 0.2);
    ASSERT_TRUE(reconstructor->Reconstruct(body.AsFrame(), state, workspace, result).ok());
    EXPECT_TRUE(Validate(result).ok()) << Validate(result);
    EXPECT_FALSE(state.outline.points.empty());
  }
}

// What particles do at worst. Rings are to be right, and near those without memory.
TEST(OutlineMemory, HoldsWhateverTheParticlesDo) {
  Random random(12);
  const auto disturb = [&](Particles particles, int kind) {
    const std::size_t count = particles.size();
    switch (kind) {
      case 0:  // Ids of a few go to other places, near and far.
        for (int k = 0; k < 10; ++k) {
          const std::size_t at = random.Below(count);
          particles.xy[2 * at] += random.Chance(0.5) ? 1e6 : 4;
        }
        break;
      case 1:  // All change places.
        for (std::size_t k = count; k > 1; --k)
          std::swap(particles.ids[k - 1], particles.ids[random.Below(k)]);
        break;
      case 2:  // Most leave.
        particles.xy.resize(count / 5 * 2);
        particles.ids.resize(count / 5);
        break;
      case 3:  // Several at one place.
        for (std::size_t k = 3; k < count; k += 3) {
          particles.xy[2 * k] = particles.xy[2 * k - 2];
          particles.xy[2 * k + 1] = particles.xy[2 * k - 1];
        }
        break;
      case 4:  // All at one place.
        for (std::size_t k = 0; k < count; ++k) particles.xy[2 * k] = particles.xy[2 * k + 1] = 1.5;
        break;
      case 5:  // A film.
        for (std::size_t k = 0; k < count; ++k) particles.xy[2 * k + 1] *= 0.02;
        break;
      default:  // Inside out.
        for (std::size_t k = 0; k < count; ++k) particles.xy[2 * k] *= -1;
    }
    return particles;
  };
  for (int kind = 0; kind < 7; ++kind) {
    RingStream with, without(kForgetful);
    for (int frame = 0; frame < 8; ++frame) {
      const Particles particles = frame % 3 == 2 ? disturb(Stirred(frame), kind) : Stirred(frame);
      with.Next(particles);
      without.Next(particles);
      EXPECT_TRUE(Validate(with.result(), Fill::kGreedy).ok()) << kind;
      EXPECT_EQ(with.rings().offsets, without.rings().offsets);
      // At most 0.3 are remembered, 0.18 go back to the area, and 0.3 are two areas' offsets.
      EXPECT_LT(DeviationOf(with.rings(), without.rings()).largest, 0.77)
          << "kind " << kind << ", frame " << frame;
    }
  }
}

}  // namespace
}  // namespace partiemc
