#include "field.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "support/oracle.h"
#include "support/particles.h"
#include "support/stages.h"

namespace partiemc {
namespace {

using support::Stages;

// Particles on both sides of the origin, as the bins keep them, for a lattice of `cell_size`.
support::Particles SmallScene(support::Random& random, double cell_size, bool volumes) {
  support::Particles particles = support::Blob(random, random.Uniform(2, 5));
  particles.Add(support::Noise(random, 10, 12));
  particles = support::WithDuplicates(particles, random, 3);
  if (volumes) {
    for (std::size_t k = 0; k < particles.size(); ++k) {
      particles.volumes.push_back(static_cast<float>(random.Uniform(0.5, 1.5)));
    }
  }
  return support::Snapped(particles, cell_size);
}

struct FieldCase {
  int seed;
  bool volumes;
};

class FieldOracleTest : public testing::TestWithParam<FieldCase> {};

TEST_P(FieldOracleTest, EveryNodeAgreesWithTheEquationsOfThePaper) {
  support::Random random(static_cast<std::uint64_t>(GetParam().seed));
  const ReconstructionParameters parameters{
      .spacing = 1.0, .kernel_radius = random.Uniform(1.5, 8), .cell_size = random.Uniform(0.4, 4)};
  const double cell = parameters.cell_size;
  Stages stages;
  stages.Run(SmallScene(random, cell, GetParam().volumes), parameters);
  const support::FieldOracle oracle(stages.particles, stages.parameters, 1.0);
  const double radius = parameters.kernel_radius;
  for (std::size_t tile = 0; tile < stages.bins.tiles.size(); ++tile) {
    for (int node = 0; node < kTileNodes; ++node) {
      const support::Vector at{cell * (32 * stages.bins.tiles[tile].x + node % kTileSize),
                               cell * (32 * stages.bins.tiles[tile].y + node / kTileSize)};
      // Float sums of kernel values near 1 are good to 1e-5; at the rim of the support, where the
      // sum itself is small, the mean is a quotient of small numbers and loses accordingly.
      const double sum = oracle.KernelSum(at);
      const double tolerance = 1e-5 * radius * (sum > 0 ? std::max(1.0, 1e-3 / sum) : 1.0);
      if (tolerance > 0.1 * radius) continue;
      ASSERT_NEAR(stages.level_set.tiles[tile][node] * cell, oracle.Value(at), tolerance)
          << "kernel radius " << radius << ", cell " << cell << ", node (" << at.x << ", " << at.y
          << "), kernel sum " << sum;
    }
  }
}

std::vector<FieldCase> FieldCases() {
  std::vector<FieldCase> cases;
  for (int seed = 1; seed <= 12; ++seed) cases.push_back({seed, seed % 2 == 0});
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Seeds, FieldOracleTest, testing::ValuesIn(FieldCases()),
                         [](const auto& tested) {
                           return std::to_string(tested.param.seed) +
                                  (tested.param.volumes ? "WithVolumes" : "");
                         });

TEST(Field, ALoneParticleIsSurroundedByCirclesOfItsDistance) {
  support::Particles particles;
  particles.Add(0, 0);
  Stages stages;
  stages.Run(particles, {.spacing = 1.0});
  const std::uint32_t tile = stages.bins.tiles.Find({0, 0});
  for (const int i : {1, 2}) {
    // Where it is not cut off by the guard, phi is the distance less r.
    EXPECT_NEAR(stages.level_set.At(stages.bins.tiles, tile, i, 0),
                i - stages.scale.reference_radius, 1e-6);
  }
}

TEST(Field, NodesThatNoParticleReachesHaveTheValueOfTheVoid) {
  support::Particles particles;
  particles.Add(10, 10);
  Stages stages;
  stages.Run(particles, {.spacing = 1.0});
  const double expected = std::max(stages.scale.kernel_radius - stages.scale.reference_radius,
                                   stages.scale.guard * stages.scale.kernel_radius / 1.164);
  EXPECT_NEAR(stages.level_set.void_value, expected, 1e-6);
  const std::uint32_t tile = stages.bins.tiles.Find({0, 0});
  EXPECT_EQ(stages.level_set.At(stages.bins.tiles, tile, 20, 20), stages.level_set.void_value);
  EXPECT_EQ(stages.level_set.At(stages.bins.tiles, tile, 32, 32), stages.level_set.void_value);
}

TEST(Field, DensityInsideALatticeIsAboutOneSoThatOnlyTheBoundaryIsNearZero) {
  Stages stages;
  stages.Run(support::Lattice(21, 21), {.spacing = 1.0});
  const std::uint32_t tile = stages.bins.tiles.Find({0, 0});
  EXPECT_NEAR(stages.level_set.At(stages.bins.tiles, tile, 10, 10), -stages.scale.reference_radius,
              1e-5);
}

TEST(Field, HasTheSameBitsForAnyNumberOfThreads) {
  Stages reference;
  support::Random random(3);
  reference.Run(support::Permuted(support::Disc(60), random), {.spacing = 1.0});
  for (const int threads : {1, 2, 7}) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(threads);
    LevelSet level_set;
    arena.execute([&] { SampleField(reference.bins, reference.scale, level_set); });
    ASSERT_EQ(level_set.tiles.size(), reference.level_set.tiles.size());
    for (std::size_t tile = 0; tile < level_set.tiles.size(); ++tile) {
      EXPECT_EQ(std::memcmp(level_set.tiles[tile].data(), reference.level_set.tiles[tile].data(),
                            sizeof(level_set.tiles[tile])),
                0)
          << threads << " threads, tile " << tile;
    }
  }
}

// Sampled node by node: tiles differ where the shift is not one of whole tiles.
TEST(Field, AShiftByWholeCellsShiftsItBitForBit) {
  support::Random random(4);
  const support::Particles particles = support::Snapped(support::Blob(random, 8), 1.0);
  Stages here;
  here.Run(particles, {.spacing = 1.0});
  for (const auto& [dx, dy] :
       {std::pair(1, 0), std::pair(-7, 19), std::pair(1'000'003, -999'983)}) {
    Stages there;
    there.Run(support::Shifted(particles, dx, dy), {.spacing = 1.0});
    for (int y = -15; y <= 15; ++y) {
      for (int x = -15; x <= 15; ++x) {
        const auto value = [](const Stages& stages, int column, int row) {
          const std::uint32_t tile =
              stages.bins.tiles.Find({row >> kTileShift, column >> kTileShift});
          if (tile == kNoTile) return stages.level_set.void_value;
          return stages.level_set.At(stages.bins.tiles, tile, column & 31, row & 31);
        };
        EXPECT_EQ(value(here, x, y), value(there, x + dx, y + dy)) << x << ", " << y;
      }
    }
  }
}

}  // namespace
}  // namespace partiemc
