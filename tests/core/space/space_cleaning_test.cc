// Cavities and bodies that cleaning and the limits of spray remove.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "frame/calibration.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/cleaning.h"
#include "space/field.h"
#include "space/space_particles.h"
#include "space/surface_of.h"
#include "support/tries.h"

namespace partiemc::space {
namespace {

using support::Ball;
using support::Random;
using support::SpaceParticles;
using support::SurfaceOf;

/// Sides of 16 x 16 x 16 nodes in eight bricks.
struct Sides {
  static constexpr int kSize = 16;
  SpaceBins bins;
  SpaceField field;

  Sides() {
    for (int brick = 0; brick < 8; ++brick) {
      bins.bricks.Insert({brick >> 2, brick >> 1 & 1, brick & 1});
    }
    bins.bricks.Seal();
    bins.cells.assign(8, {});
    field.inside.resize(8);
  }
  std::uint64_t& Word(int x, int y, int z) {
    return field.inside[bins.bricks.Find({z / 8, y / 8, x / 8})][z % 8];
  }
  bool Is(int x, int y, int z) { return (Word(x, y, z) >> (y % 8 * 8 + x % 8) & 1) != 0; }
  void Set(int x, int y, int z, bool is_inside) {
    const std::uint64_t bit = std::uint64_t{1} << (y % 8 * 8 + x % 8);
    if (is_inside) {
      Word(x, y, z) |= bit;
    } else {
      Word(x, y, z) &= ~bit;
    }
  }
};

/// Fills cavities node by node: the outside nodes that a flood along edges and diagonals of faces
/// reaches from each node.
std::uint64_t FillByFlood(std::size_t most, Sides& sides) {
  constexpr int kSize = Sides::kSize;
  std::vector<std::uint8_t> is_seen(kSize * kSize * kSize);
  std::uint64_t filled = 0;
  const auto index = [](int x, int y, int z) { return (z * kSize + y) * kSize + x; };
  for (int start = 0; start < kSize * kSize * kSize; ++start) {
    const int x0 = start % kSize, y0 = start / kSize % kSize, z0 = start / kSize / kSize;
    if (is_seen[start] != 0 || sides.Is(x0, y0, z0)) continue;
    std::vector<int> found{start};
    is_seen[start] = 1;
    bool is_open = false;
    for (std::size_t n = 0; n < found.size(); ++n) {
      const int x = found[n] % kSize, y = found[n] / kSize % kSize, z = found[n] / kSize / kSize;
      for (int k = 0; k < 27; ++k) {
        const int dx = k % 3 - 1, dy = k / 3 % 3 - 1, dz = k / 9 - 1;
        const int along = std::abs(dx) + std::abs(dy) + std::abs(dz);
        if (along == 0 || along == 3) continue;
        const int i = x + dx, j = y + dy, l = z + dz;
        if (i < 0 || j < 0 || l < 0 || i >= kSize || j >= kSize || l >= kSize) {
          is_open = true;
        } else if (!sides.Is(i, j, l) && is_seen[index(i, j, l)] == 0) {
          is_seen[index(i, j, l)] = 1;
          found.push_back(index(i, j, l));
        }
      }
    }
    if (is_open || found.size() > most) continue;
    ++filled;
    for (const int node : found) sides.Set(node % kSize, node / kSize % kSize, node / 256, true);
  }
  return filled;
}

TEST(SpaceCleaning, FillsTheCavitiesThatAFloodFinds) {
  CleaningScratch scratch;
  std::uint64_t total = 0;
  for (std::uint64_t seed = 0; seed < support::Tries(60u); ++seed) {
    Random random(seed);
    Sides sides;
    const double density = random.Uniform(.7, .97);
    for (int node = 0; node < 4096; ++node) {
      sides.Set(node % 16, node / 16 % 16, node / 256, random.Chance(density));
    }
    for (const std::size_t most : {0u, 1u, 3u, 15u}) {
      Sides filled = sides, expected = sides;
      const std::uint64_t count = FillCavities(filled.bins.bricks, most, scratch, filled.field);
      EXPECT_EQ(count, FillByFlood(most, expected));
      EXPECT_EQ(filled.field.inside, expected.field.inside) << seed << ", " << most;
      total += count;
    }
  }
  EXPECT_GT(total, support::Tries(1000u));
}

TEST(SpaceCleaning, DropsBodiesWithoutParticles) {
  Sides sides;
  SpaceParticles particles;
  particles.Add({4, 4, 4});
  for (int k = 0; k < 3; ++k) {
    sides.Set(4, 4, 3 + k, true);
    sides.Set(12, 7 + k, 9, true);  // In two bricks, far from the particle.
  }
  Scale scale;
  scale.cell_size = 1;
  scale.kernel_radius = 3;
  SpaceBins bins;
  ASSERT_TRUE(BinParticles(particles.AsFrame(), scale, {}, bins).ok());
  SpaceField field;
  for (const BrickCoordinate& brick : bins.bricks.bricks()) {
    const std::uint32_t index = sides.bins.bricks.Find(brick);
    field.inside.push_back(index == kNoIndex ? BrickBits{} : sides.field.inside[index]);
  }
  Bodies bodies;
  CleaningScratch scratch;
  FindBodies(particles.AsFrame(), bins, field, 1, 3, bodies);
  const std::size_t found = bodies.bodies.size();
  ASSERT_GE(found, 2u);
  EXPECT_EQ(DropBodies({}, scratch, bodies, field).empty, 0u);
  EXPECT_EQ(DropBodies({.drops_empty = true}, scratch, bodies, field).empty, found - 1);
  ASSERT_EQ(bodies.bodies.size(), 1u);
  EXPECT_EQ(bodies.bodies[0].particles, 1u);
  int inside = 0;
  for (std::uint32_t brick = 0; brick < bins.bricks.size(); ++brick) {
    for (const std::uint64_t word : field.inside[brick]) inside += CountBits(word);
  }
  EXPECT_EQ(inside, 3);
  // The parts have been renumbered, too.
  Bodies again;
  FindBodies(particles.AsFrame(), bins, field, 1, 3, again);
  EXPECT_EQ(again.first, bodies.first);
  ASSERT_EQ(again.parts.size(), bodies.parts.size());
  EXPECT_EQ(again.parts[0].body, bodies.parts[0].body);
}

std::uint64_t Dropped(const Surface& surface) {
  const SurfaceStatistics& statistics = surface.statistics;
  return statistics.dropped_cavities + statistics.dropped_components + statistics.dropped_spray;
}

TEST(SpaceCleaning, DropsSprayOnRequest) {
  Random random(1);
  const SpaceParticles ball = Ball({0, 0, 0}, 4, .1, random);
  SpaceParticles particles = ball;
  particles.Add({20, 0, 0});
  particles.Add(Ball({0, 20, 0}, 1, .1, random));  // Seven particles.
  for (const SurfacePlacement placement :
       {SurfacePlacement::kMarchingCubes, SurfacePlacement::kVirtualPlane}) {
    SurfaceParameters parameters{.placement = placement};
    const Surface all = SurfaceOf(particles, parameters);
    EXPECT_EQ(all.ShellCount(), 3u);
    EXPECT_EQ(Dropped(all), 0u);
    parameters.min_component_particles = 7;
    EXPECT_EQ(SurfaceOf(particles, parameters).ShellCount(), 2u);
    parameters.min_component_particles = 8;
    Surface large = SurfaceOf(particles, parameters);
    EXPECT_EQ(large.statistics.dropped_spray, 2u);
    // The ball has the bits that it has alone.
    const Surface alone = SurfaceOf(ball, {.placement = placement});
    large.statistics = alone.statistics;
    EXPECT_EQ(large, alone);
    parameters.min_component_particles = 0;
    parameters.min_component_volume = 7.5;
    EXPECT_EQ(SurfaceOf(particles, parameters).statistics.dropped_spray, 2u);
    parameters.min_component_volume = 7;
    EXPECT_EQ(SurfaceOf(particles, parameters).statistics.dropped_spray, 1u);
    parameters.min_component_volume = 1e9;
    EXPECT_EQ(SurfaceOf(particles, parameters).ShellCount(), 0u);
  }
}

TEST(SpaceCleaning, FillsSmallCavitiesOfFrames) {
  // Balls with voids of different sizes, in fine cells: voids below two particles are filled.
  const double radius_of_mean = 1.065 * CalibratedSliceRadius(3);
  std::uint64_t filled = 0;
  int kept = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Random random(seed);
    const double radius = 1.2 + .3 * static_cast<double>(seed);
    SpaceParticles particles;
    const SpaceParticles ball = Ball({0, 0, 0}, 4.5, .1, random);
    for (std::size_t k = 0; k < ball.size(); ++k) {
      if (Length(ball.At(k)) > radius) particles.Add(ball.At(k));
    }
    SurfaceParameters parameters{.cell_size = .5, .reference_radius = radius_of_mean};
    const Surface before = SurfaceOf(particles, parameters);
    EXPECT_EQ(Dropped(before), 0u);
    parameters.clean = true;
    const Surface after = SurfaceOf(particles, parameters);
    EXPECT_EQ(after.statistics.dropped_cavities, before.ShellCount() - after.ShellCount());
    filled += after.statistics.dropped_cavities;
    for (const ShellMeasures& shell : after.measures) {
      if (shell.volume >= 0) continue;
      ++kept;
      EXPECT_LT(shell.volume, -1);
    }
    if (after.statistics.dropped_cavities == 0) continue;
    // The default placement cleans without being asked.
    parameters.placement = SurfacePlacement::kVirtualPlane;
    parameters.clean = std::nullopt;
    EXPECT_EQ(SurfaceOf(particles, parameters).statistics, after.statistics);
  }
  EXPECT_GT(filled, 0u);
  EXPECT_GT(kept, 0);
}

TEST(SpaceCleaning, RefusesBadVolumes) {
  EXPECT_FALSE(SurfaceReconstructor::Create({.min_component_volume = -1}).ok());
  const auto refused = SurfaceReconstructor::Create({.min_component_volume = std::nan("")});
  ASSERT_FALSE(refused.ok());
  const auto violation = FindViolation(refused.status());
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->field, "parameters.surface.min_component_volume");
  EXPECT_EQ(violation->reason, kReasonOutOfRange);
}

}  // namespace
}  // namespace partiemc::space
