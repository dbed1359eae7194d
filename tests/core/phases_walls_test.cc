// Phases of fluids at walls: interfaces end on walls, and phases divide the body.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "core/divided_phases.h"
#include "core/phases_in_boxes.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/instruction_sets.h"
#include "support/phase_scenes.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tries.h"
#include "support/wall_scenes.h"

namespace partiemc {
namespace {

using support::Body;
using support::Particles;
using support::PhaseScene;
using support::Random;
using support::ReconstructOnce;
using support::WallFrame;

constexpr int kTankColumns = 40, kTankRows = 24;
const Wall kWideTank{{0, 60, 0, 0, kTankColumns, 0, kTankColumns, 60}};

ReconstructionParameters PhasesAt(std::vector<Wall> walls, int count) {
  ReconstructionParameters parameters = WithPhases(count);
  parameters.walls = std::move(walls);
  return parameters;
}

// The angles of a phase at its contacts with a wall, in degrees, in the order of the points.
std::vector<double> AnglesOf(const Rings& rings) {
  std::vector<double> angles;
  for (const float angle : rings.contact_angles) {
    angles.push_back(angle * 180 / std::numbers::pi);
  }
  return angles;
}

std::size_t WettedOf(const Result& result) {
  std::size_t count = 0;
  for (const Result& phase : result.sections) count += phase.rings.wetted.size();
  return count;
}

TEST(PhasesAtWalls, LayersInATankEndOnItsSides) {
  const auto at = [](double, double y) { return y < 10 ? 1 : 2; };
  const Particles layers = Labelled(kTankColumns, kTankRows, .1, at);
  const Result result = ReconstructOnce(PhasesAt({kWideTank}, 2), layers);
  ExpectDivided(result, Fill::kGreedy);
  const Rings &lower = result.sections[0].rings, &upper = result.sections[1].rings;
  EXPECT_NEAR(result.sections[0].statistics.area, 400, .1);
  EXPECT_NEAR(result.sections[1].statistics.area, 560, .1);
  // Each segment of the body on a wall belongs to one phase.
  EXPECT_EQ(WettedOf(result), result.rings.wetted.size());
  ASSERT_EQ(lower.contacts.size(), 2u);
  for (const std::uint32_t contact : lower.contacts) {
    const double x = lower.points[2 * std::size_t{contact}];
    EXPECT_TRUE(x == 0 || x == kTankColumns) << x;
    EXPECT_NEAR(lower.points[2 * std::size_t{contact} + 1], 10, .1);
  }
  // The interface and the free outline.
  EXPECT_EQ(upper.contacts.size(), 4u);
  for (const Rings* const rings : {&lower, &upper}) {
    for (const double angle : AnglesOf(*rings)) EXPECT_NEAR(angle, 90, 3);
  }
}

// A drop of one phase on the bottom of another one, with a known angle.
TEST(PhasesAtWallsAccuracy, DropsOfAPhaseOnAFloor) {
  std::printf("%8s %6s %8s %7s %10s %8s\n", "degrees", "noise", "contact", "angle", "interface",
              "area");
  for (const double degrees : {60.0, 90.0, 120.0}) {
    for (const double noise : {0.0, .1}) {
      constexpr int kPlacements = 6;
      constexpr double kRadius = 14;
      const double angle = degrees * std::numbers::pi / 180;
      const double centre = -kRadius * std::cos(angle), half = kRadius * std::sin(angle);
      double contact = 0, turned = 0, deviation = 0, area = 0;
      int contacts = 0, points = 0;
      Random random(81);
      for (int k = 0; k < kPlacements; ++k) {
        const WallFrame frame(random);
        const auto drop = [&](double x, double y) {
          return std::hypot(frame.A(x, y), frame.W(x, y) - centre) - kRadius;
        };
        const Body slab{[&](double x, double y) {
                          const double a = frame.A(x, y), w = frame.W(x, y);
                          return std::max({-w, w - 34, std::abs(a) - 28});
                        },
                        50};
        const PhaseScene scene{slab,
                               {{1, drop}, {2, [&](double x, double y) { return -drop(x, y); }}}};
        Particles particles = Filled(scene, random);
        particles = support::Jittered(particles, random, noise * std::numbers::sqrt3);
        const Result result = ReconstructOnce(PhasesAt({frame.Floor()}, 2), particles);
        ExpectDivided(result, Fill::kGreedy);
        const Rings& rings = result.sections[0].rings;
        const double volume = CountOf(particles, 1);
        area = std::max(area, std::abs(result.sections[0].statistics.area / volume - 1));
        for (std::size_t c = 0; c < rings.contacts.size(); ++c) {
          const std::size_t p = 2 * std::size_t{rings.contacts[c]};
          contact += std::abs(std::abs(frame.A(rings.points[p], rings.points[p + 1])) - half);
          turned += std::abs(AnglesOf(rings)[c] - degrees);
          ++contacts;
        }
        for (std::size_t p = 0; p < rings.points.size(); p += 2) {
          if (frame.W(rings.points[p], rings.points[p + 1]) < .1) continue;
          deviation += std::abs(drop(rings.points[p], rings.points[p + 1]));
          ++points;
        }
      }
      ASSERT_EQ(contacts, 2 * kPlacements);
      EXPECT_LT(contact / contacts, .2);
      EXPECT_LT(turned / contacts, 4);
      EXPECT_LT(deviation / points, .08);
      EXPECT_LT(area, .01);
      std::printf("%8.0f %6.1f %8.3f %7.2f %10.3f %7.2f%%\n", degrees, noise, contact / contacts,
                  turned / contacts, deviation / points, 100 * area);
    }
  }
}

// Two phases between walls of particles of a third one.
TEST(PhasesAtWalls, WallParticlesAreNoPhase) {
  Particles particles = support::Lattice(kTankColumns + 4, 30, -1.5, -1.5);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double x = particles.x(k), y = particles.y(k);
    const bool is_wall = x < 0 || x > kTankColumns || y < 0;
    particles.phases.push_back(is_wall ? 3.0F : x < 15 ? 1.0F : 2.0F);
  }
  ReconstructionParameters parameters = PhasesAt({}, 2);
  parameters.wall_phases = {3};
  const Result result = ReconstructOnce(parameters, particles);
  ExpectDivided(result, Fill::kGreedy);
  const double height = 28;
  EXPECT_NEAR(result.sections[0].statistics.area, 15 * height, 2);
  EXPECT_NEAR(result.sections[1].statistics.area, 25 * height, 2);
  EXPECT_EQ(result.sections[0].statistics.particles, 15u * 28);
  EXPECT_EQ(WettedOf(result), result.rings.wetted.size());
  const Rings& left = result.sections[0].rings;
  bool ends_on_floor = false;
  for (const std::uint32_t contact : left.contacts) {
    const double x = left.points[2 * std::size_t{contact}];
    const double y = left.points[2 * std::size_t{contact} + 1];
    ends_on_floor |= std::abs(x - 15) < .1 && std::abs(y) < .1;
  }
  EXPECT_TRUE(ends_on_floor);
  // Errors name the caller's particle.
  particles.phases[7] = 1.5F;
  const auto violation = support::RefusalOf(parameters, particles);
  ASSERT_TRUE(violation.has_value());
  EXPECT_NE(violation->field.find("[7]"), std::string::npos) << violation->field;
}

// Layers on the floor of a channel, whose interface ends on an obstacle.
TEST(PhasesAtWalls, ChannelsAreCutAnywhere) {
  const auto at = [](double, double y) { return y < 6 ? 1 : 2; };
  Particles layers;
  const Particles all = Labelled(static_cast<int>(kPhaseLength), 14, .1, at);
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (std::hypot(all.x(k) - 20, all.y(k) - 6) < 4.2) continue;
    layers.Add(all.x(k), all.y(k));
    layers.phases.push_back(all.phases[k]);
  }
  std::vector<double> areas;
  for (const double shift : {0.0, 13.0, 28.0}) {
    SCOPED_TRACE(shift);
    ReconstructionParameters parameters = PhasesIn(PhaseChannel(), 2);
    parameters.walls = {{{0, 0, 1, 0}}, support::PolygonWall(20 + shift, 6, 4.2, 24, .1, false)};
    const Result result =
        ReconstructOnce(parameters, Wrapped(support::Shifted(layers, shift, 0), *parameters.box));
    ExpectDivided(result, Fill::kGreedy);
    EXPECT_EQ(result.statistics.cut_bodies, 1u);
    EXPECT_EQ(WettedOf(result), result.rings.wetted.size());
    areas.push_back(result.sections[0].statistics.area);
    EXPECT_NEAR(areas.back(), areas.front(), .05);
    // The interface ends on both sides of the obstacle.
    EXPECT_EQ(result.sections[0].rings.contacts.size(), 2u);
  }
}

TEST(PhasesAtWalls, AnyNumberOfThreadsAndAnyInstructionSetGivesTheSameBits) {
  const auto at = [](double x, double y) { return y < 10 ? 1 : x < 25 ? 2 : 3; };
  const Particles layers = Labelled(kTankColumns, kTankRows, .1, at);
  const ReconstructionParameters parameters = PhasesAt({kWideTank}, 3);
  const Result expected = ReconstructOnce(parameters, layers);
  for (const std::size_t threads : {1u, 2u, 7u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(ReconstructOnce(parameters, layers), expected);
  }
  support::ForEachInstructionSet([&] { EXPECT_EQ(ReconstructOnce(parameters, layers), expected); });
}

// Two layers slosh in a tank; each frame has another order of particles.
TEST(PhasesAtWalls, LayersKeepTheirIdentitiesWhileTheySlosh) {
  const auto at = [](double, double y) { return y < 10 ? 1 : 2; };
  const Particles layers = Labelled(kTankColumns, kTankRows, .1, at);
  const auto reconstructor = Reconstructor::Create(PhasesAt({kWideTank}, 2));
  ASSERT_TRUE(reconstructor.ok());
  Random random(6);
  State state;
  Workspace workspace;
  Result result;
  std::vector<std::uint64_t> first;
  for (int frame = 0; frame < 40; ++frame) {
    SCOPED_TRACE(frame);
    Particles moved = layers;
    for (std::size_t k = 0; k < moved.size(); ++k) {
      const double wave = std::cos(std::numbers::pi * moved.x(k) / kTankColumns);
      moved.xy[2 * k + 1] *= 1 + .12 * std::sin(frame / 6.0) * wave;
      moved.ids.push_back(k);
    }
    const Particles given = support::Permuted(moved, random);
    ASSERT_TRUE(reconstructor->Reconstruct(given.AsFrame(), state, workspace, result).ok());
    std::vector<std::uint64_t> identities{result.rings.measures.at(0).identity};
    for (const Result& phase : result.sections) {
      EXPECT_EQ(phase.rings.RingCount(), 1u);
      identities.push_back(phase.rings.measures.at(0).identity);
    }
    if (frame == 0) first = identities;
    EXPECT_EQ(identities, first);
    EXPECT_NEAR(result.sections[0].statistics.area, 400, 2);
  }
}

TEST(PhasesAtWalls, PhasesDivideTheBodyInRandomFrames) {
  std::size_t contacts = 0, wetted = 0, beyond = 0, points = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(600u) && !HasFailure(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const bool has_sizes = random.Chance(.3);
    Particles particles =
        has_sizes ? support::RandomSizes(seed, .5, 3) : support::RandomScene(seed);
    const int count = 1 + static_cast<int>(random.Below(4));
    ReconstructionParameters parameters = PhasesAt(support::RandomWalls(random, particles), count);
    if (has_sizes) parameters.sizes = Sizes::kOwn;
    parameters.fill = AllFills()[seed % AllFills().size()];
    if (random.Chance(.2)) parameters.cell_size = random.Uniform(.5, 1.5);
    DrawPhases(random, count, particles);
    if (random.Chance(.3)) {
      parameters.wall_phases = {9};
      const double share = random.Uniform(0, .3), from = random.Uniform(0, 20);
      for (std::size_t k = 0; k < particles.size(); ++k) {
        const double place = std::fmod(std::abs(particles.x(k) - particles.x(0)) + from, 30) / 30;
        if (place < share) particles.phases[k] = 9;
      }
      if (random.Chance(.5)) parameters.walls.clear();
    }
    if (parameters.walls.empty() && random.Chance(.5)) {
      const double length = random.Uniform(50, 90);
      parameters.box = PeriodicBox{.axes = {PeriodicAxis{0, length}, {}, {}}};
      parameters.box->wraps = random.Chance(.3);
    }
    const Result result = ReconstructOnce(parameters, particles);
    ExpectDivided(result, parameters.fill);
    for (const Result& phase : result.sections) contacts += phase.rings.contacts.size();
    wetted += WettedOf(result);
    // Cuts divide wetted segments.
    if (!parameters.box) {
      EXPECT_EQ(WettedOf(result), result.rings.wetted.size());
    }
    points += result.rings.PointCount();
    for (std::size_t k = 0; k < result.rings.PointCount(); ++k) {
      const double x = result.rings.points[2 * k], y = result.rings.points[2 * k + 1];
      beyond += std::ranges::any_of(parameters.walls, [&](const Wall& wall) {
        return support::HeightAbove(wall, x, y) < -1e-6;
      });
    }
  }
  std::printf("%zu contacts, %zu wetted, %zu of %zu points beyond a wall\n", contacts, wetted,
              beyond, points);
  EXPECT_LE(beyond, points / 30'000);
  EXPECT_GT(contacts, support::Tries(600u));
  EXPECT_GT(wetted, support::Tries(600u));
}

}  // namespace
}  // namespace partiemc
