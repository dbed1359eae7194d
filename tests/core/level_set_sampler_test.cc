#include "sampler/level_set_sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "field/level_set_formula.h"
#include "support/instruction_sets.h"
#include "support/oracle.h"
#include "support/particles.h"
#include "support/stages.h"

namespace partiemc {
namespace {

using support::Stages;

class PointFieldTest : public testing::TestWithParam<int> {};

TEST_P(PointFieldTest, ValueAndGradientAgreeWithTheEquationsOfThePaper) {
  support::Random random(static_cast<std::uint64_t>(GetParam()));
  const double cell = random.Uniform(0.4, 3);
  support::Particles particles = support::Blob(random, random.Uniform(3, 6));
  particles.Add(support::Noise(random, 10, 12));
  if (GetParam() % 2 == 0) {
    for (std::size_t k = 0; k < particles.size(); ++k) {
      particles.volumes.push_back(static_cast<float>(random.Uniform(0.5, 1.5)));
    }
  }
  Stages stages;
  stages.Run(support::Snapped(particles, cell),
             {.spacing = 1.0, .kernel_radius = random.Uniform(1.5, 8), .cell_size = cell});
  const support::FieldOracle oracle(stages.particles, stages.parameters, 1.0);
  int on_phi = 0, on_guard = 0, on_gap = 0;
  for (int k = 0; k < 3000 && on_phi + on_guard + on_gap < 400; ++k) {
    // Round any particle, every other time one of the lone ones, where the guard rules.
    const std::size_t lone = random.Chance(0.5) ? particles.size() - 10 : 0;
    const std::size_t near = lone + random.Below(particles.size() - lone);
    const double reach = 1.2 * oracle.kernel_radius();
    const support::Vector at{particles.x(near) + random.Uniform(-reach, reach),
                             particles.y(near) + random.Uniform(-reach, reach)};
    const TileCoordinate place{static_cast<std::int32_t>(std::floor(at.y / cell / 32)),
                               static_cast<std::int32_t>(std::floor(at.x / cell / 32))};
    const std::uint32_t tile = stages.bins.tiles.Find(place);
    if (tile == kNoTile) continue;
    const double x = at.x / cell - 32.0 * place.x;
    const double y = at.y / cell - 32.0 * place.y;
    if (!stages.field.Covers(tile, x, y)) continue;
    const FieldSample sample = stages.field.Sample(tile, x, y);
    // Where the kernel sum is tiny the mean is a quotient of roundings, and nearer than a step of
    // the differences to the crease between the branches they see both.
    if (oracle.KernelSum(at) < 1e-3) continue;
    if (oracle.CreaseMargin(at) < 1e-3) continue;
    EXPECT_TRUE(sample.has_support);
    EXPECT_NEAR(sample.density, oracle.Density(at), 1e-5);
    EXPECT_NEAR(sample.phi * cell, oracle.Phi(at), 1e-5);
    EXPECT_NEAR(sample.value * cell, oracle.Value(at), 1e-5);
    const support::Vector mean = *oracle.Mean(at);
    EXPECT_NEAR(sample.mean_x * cell, mean.x - at.x, 1e-5);
    EXPECT_NEAR(sample.mean_y * cell, mean.y - at.y, 1e-5);
    const double mean_distance = std::hypot(mean.x - at.x, mean.y - at.y);
    if (mean_distance > 0.01) {  // Nearer, |x - xbar| has its kink within the differences' reach.
      const support::Vector phi_gradient = oracle.PhiGradient(at);
      const support::Vector gradient = oracle.ValueGradient(at);
      const double tolerance = 1e-4 * std::max(1.0, std::hypot(gradient.x, gradient.y)) *
                               std::max(1.0, 0.1 / mean_distance);
      EXPECT_NEAR(sample.phi_x, phi_gradient.x, tolerance);
      EXPECT_NEAR(sample.phi_y, phi_gradient.y, tolerance);
      EXPECT_NEAR(sample.gradient_x, gradient.x, tolerance);
      EXPECT_NEAR(sample.gradient_y, gradient.y, tolerance);
    }
    const double value = oracle.Value(at);
    on_phi += value == oracle.Phi(at);
    on_guard += value == oracle.Guard(at);
    on_gap += value == oracle.Gap(at);
  }
  EXPECT_GT(on_phi, 20);
  EXPECT_GT(on_guard, 0);
  EXPECT_GT(on_gap, 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PointFieldTest, testing::Range(1, 13));

TEST(LevelSetSampler, AgreesWithTheFieldStageAtNodes) {
  support::Random random(5);
  Stages stages;
  stages.Run(support::Snapped(support::Blob(random, 8), 1.0), {.spacing = 1.0});
  int checked = 0;
  for (std::uint32_t tile = 0; tile < stages.bins.tiles.size(); ++tile) {
    if (!stages.field.IsIndexed(tile)) continue;
    for (int node = 0; node < kTileNodes; ++node) {
      const int i = node % kTileSize;
      const int j = node / kTileSize;
      // Exact where an edge is crossed.
      const float value = stages.level_set.At(stages.bins.tiles, tile, i, j);
      if ((value < 0) == (stages.level_set.At(stages.bins.tiles, tile, i + 1, j) < 0)) continue;
      EXPECT_NEAR(stages.field.Sample(tile, i, j).value, value, 1e-5);
      ++checked;
    }
  }
  EXPECT_GT(checked, 10);
}

TEST(LevelSetSampler, APointWithoutSupportSaysSoAndHasNoGradient) {
  support::Particles particles;
  particles.Add(3, 3);
  Stages stages;
  stages.Run(particles, {.spacing = 1.0});
  const FieldSample sample = stages.field.Sample(stages.bins.tiles.Find({0, 0}), 20, 20);
  EXPECT_FALSE(sample.has_support);
  EXPECT_EQ(sample.value, VoidValue(stages.scale));
  EXPECT_EQ(sample.gradient_x, 0);
  EXPECT_EQ(sample.gradient_y, 0);
}

TEST(LevelSetSampler, AtTheWeightedMeanItselfTheGradientOfPhiIsZeroAndNotNan) {
  support::Particles particles;
  particles.Add(3, 3);
  Stages stages;
  stages.Run(particles, {.spacing = 1.0});
  const FieldSample sample = stages.field.Sample(stages.bins.tiles.Find({0, 0}), 3, 3);
  EXPECT_EQ(sample.phi, -stages.scale.reference_radius);
  EXPECT_EQ(sample.phi_x, 0);
  EXPECT_EQ(sample.phi_y, 0);
}

// Particles alone and in bodies, wide kernels and narrow ones, cells of any size: with small cells
// there are gaps between the tiles that have particles, and runs of more than four of them.
TEST(LevelSetSampler, FindsEveryParticleWithinARadiusAndNamesItsPlaceInTheFrame) {
  struct Lengths {
    double kernel_radius, cell;
  };
  for (const auto& [kernel_radius, cell] :
       {Lengths{3, 1}, {3, 0.25}, {8, 0.25}, {5.3, 0.5}, {8, 4}, {1.5, 4}}) {
    SCOPED_TRACE(testing::Message() << "radius " << kernel_radius << ", cell " << cell);
    support::Random random(6);
    support::Particles particles = support::Blob(random, 25);
    particles.Add(support::Noise(random, 300, 40));
    Stages stages;
    stages.Run(support::Snapped(particles, cell),
               {.spacing = 1.0, .kernel_radius = kernel_radius, .cell_size = cell});
    int found = 0;
    for (int k = 0; k < 1500; ++k) {
      const auto tile = static_cast<std::uint32_t>(random.Below(stages.bins.tiles.size()));
      const double x = random.Uniform(0, 32);
      const double y = random.Uniform(0, 32);
      if (!stages.field.Covers(tile, x, y)) continue;
      const double radius = random.Uniform(0.1, stages.scale.kernel_radius);
      std::vector<std::uint32_t> expected, visited;
      for (std::uint32_t p = 0; p < stages.particles.size(); ++p) {
        const double dx = stages.particles.x(p) / cell - 32.0 * stages.bins.tiles[tile].x - x;
        const double dy = stages.particles.y(p) / cell - 32.0 * stages.bins.tiles[tile].y - y;
        if (dx * dx + dy * dy <= radius * radius) expected.push_back(p);
      }
      stages.field.ForEachNear(tile, x, y, radius,
                               [&](double px, double py, std::uint32_t particle) {
                                 if ((px - x) * (px - x) + (py - y) * (py - y) > radius * radius)
                                   return;
                                 visited.push_back(stages.field.SourceOf(particle));
                               });
      std::sort(visited.begin(), visited.end());
      EXPECT_EQ(visited, expected);
      found += static_cast<int>(expected.size());
    }
    EXPECT_GT(found, 100);
  }
}

template <typename Sample>
void ExpectSameBits(const LevelSetSample& a, const Sample& b) {
  EXPECT_EQ(a.value, b.value);
  EXPECT_EQ(a.gradient_x, b.gradient_x);
  EXPECT_EQ(a.gradient_y, b.gradient_y);
}

// A blob, in which one place has more particles than are summed at once, and lone particles,
// between which there are gaps.
void RunCrowdedBlob(bool weighted, Stages& stages) {
  support::Random random(8);
  support::Particles particles = support::Blob(random, 20);
  for (int k = 0; k < 600; ++k) particles.Add(random.Uniform(18, 20), random.Uniform(-1, 1));
  particles.Add(support::Noise(random, 40, 300));
  for (std::size_t k = 0; weighted && k < particles.size(); ++k) {
    particles.volumes.push_back(static_cast<float>(random.Uniform(0.5, 1.5)));
  }
  stages.Run(support::Snapped(particles, 1.0), {.spacing = 1.0});
}

// Batches of one point each, or of up to kPointsAtOnce.
std::vector<FieldPoints> NeighboursIn(const Stages& stages) {
  support::Random random(9);
  std::vector<FieldPoints> all;
  while (all.size() < 300) {
    FieldPoints group{
        static_cast<std::uint32_t>(random.Below(stages.bins.tiles.size())), 0, {}, {}};
    const Point first{random.Uniform(0, 32), random.Uniform(0, 32)};
    const std::size_t count = 1 + random.Below(kPointsAtOnce);
    for (int tries = 0; group.count < count && tries < 20; ++tries) {
      const Point next{first.x + random.Uniform(-1, 1), first.y + random.Uniform(-1, 1)};
      if (std::min(next.x, next.y) < 0 || std::max(next.x, next.y) >= 32) continue;
      if (stages.field.Covers(group.tile, next.x, next.y)) group.points[group.count++] = next;
    }
    if (group.count == count) all.push_back(group);
  }
  return all;
}

TEST(LevelSetSampler, SamplesHaveTheSameBitsForEveryInstructionSetAndBatch) {
  for (const bool weighted : {false, true}) {
    Stages stages;
    RunCrowdedBlob(weighted, stages);
    const std::vector<FieldPoints> places = NeighboursIn(stages);
    std::vector<FieldSamples> alone(places.size());
    int in_gaps = 0;  // Or nearly.
    for (std::size_t k = 0; k < places.size(); ++k) {
      stages.field.Sample({&places[k], 1}, {&alone[k], 1});
      const auto& [x, y] = places[k].points[0];
      const FieldSample sample = stages.field.Sample(places[k].tile, x, y);
      in_gaps += sample.value > sample.phi && sample.spread > stages.scale.gap_spread;
    }
    EXPECT_GT(in_gaps, 10);
    support::ForEachInstructionSet([&] {
      for (std::size_t at_once = 1; at_once <= kQueriesAtOnce; ++at_once) {
        for (std::size_t first = 0; first < places.size(); first += at_once) {
          const std::size_t count = std::min(at_once, places.size() - first);
          std::array<FieldSamples, kQueriesAtOnce> samples;
          stages.field.Sample(std::span(places).subspan(first, count), samples);
          for (std::size_t q = 0; q < count; ++q) {
            for (std::size_t k = 0; k < places[first + q].count; ++k) {
              ExpectSameBits(samples[q][k], alone[first + q][k]);
            }
          }
        }
      }
    });
  }
}

TEST(LevelSetSampler, PointsOfAGroupAgreeWithEachAlone) {
  for (const bool weighted : {false, true}) {
    Stages stages;
    RunCrowdedBlob(weighted, stages);
    for (const FieldPoints& place : NeighboursIn(stages)) {
      FieldSamples samples;
      stages.field.Sample({&place, 1}, {&samples, 1});
      for (std::size_t k = 0; k < place.count; ++k) {
        const auto& [x, y] = place.points[k];
        const FieldSample alone = stages.field.Sample(place.tile, x, y);
        if (place.count == 1) {
          ExpectSameBits(samples[k], alone);
          continue;
        }
        // They sum the same particles in another order, in floats: far inside, F is the density,
        // of which a crowd has a lot.
        EXPECT_NEAR(samples[k].value, alone.value, 1e-5 + 3e-7 * std::abs(alone.value));
        const double distance = std::hypot(alone.mean_x, alone.mean_y);
        const double tolerance = 1e-4 * std::max(1.0, 0.1 / distance);
        EXPECT_NEAR(samples[k].gradient_x, alone.gradient_x, tolerance);
        EXPECT_NEAR(samples[k].gradient_y, alone.gradient_y, tolerance);
      }
    }
  }
}

// Sums over particles have the same bits however these were sorted only if their order is one.
TEST(LevelSetSampler, ListsParticlesOfABucketInTheOrderOfTheFrame) {
  for (const double radius : {3.0, 2.6}) {
    support::Random random(7);
    support::Particles particles = support::Blob(random, 20);
    for (int k = 0; k < 2000; ++k) particles.Add(random.Uniform(-1, 1), random.Uniform(-25, 25));
    Stages stages;
    stages.Run(support::Snapped(particles, 1.0), {.spacing = 1.0, .kernel_radius = radius});
    int pairs = 0;
    for (int k = 0; k < 500; ++k) {
      const auto tile = static_cast<std::uint32_t>(random.Below(stages.bins.tiles.size()));
      const double x = random.Chance(0.5) ? 31.999 : random.Uniform(0, 32);
      const double y = random.Uniform(0, 32);
      if (!stages.field.Covers(tile, x, y)) continue;
      std::optional<std::uint32_t> last;
      stages.field.ForEachNear(tile, x, y, 0, [&](double, double, std::uint32_t particle) {
        const std::uint32_t source = stages.field.SourceOf(particle);
        if (last) {
          EXPECT_LT(*last, source);
          ++pairs;
        }
        last = source;
      });
    }
    EXPECT_GT(pairs, 100);
  }
}

}  // namespace
}  // namespace partiemc
