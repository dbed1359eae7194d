#include "field/field.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "field/tile_kernels.h"
#include "support/instruction_sets.h"
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

class FieldOracleTest : public testing::TestWithParam<FieldCase> {
 protected:
  FieldOracleTest() : random_(static_cast<std::uint64_t>(GetParam().seed)) {
    parameters_ = {.spacing = 1.0,
                   .kernel_radius = random_.Uniform(1.5, 8),
                   .cell_size = random_.Uniform(0.4, 4)};
    stages_.Run(SmallScene(random_, parameters_.cell_size, GetParam().volumes), parameters_);
    oracle_.emplace(stages_.particles, stages_.parameters, 1.0);
  }

  support::Vector Node(std::size_t tile, int i, int j) const {
    const double cell = parameters_.cell_size;
    return {cell * (32 * stages_.bins.tiles[tile].x + i),
            cell * (32 * stages_.bins.tiles[tile].y + j)};
  }

  // How far F may be off, in world units. Float sums of kernel values near 1 are good to 1e-5; at
  // the rim of the support, where the sum itself is small, the mean is a quotient of small numbers
  // and loses accordingly.
  double Tolerance(support::Vector at) const {
    const double sum = oracle_->KernelSum(at);
    return 1e-5 * parameters_.kernel_radius * (sum > 0 ? std::max(1.0, 1e-3 / sum) : 1.0);
  }

  support::Random random_;
  ReconstructionParameters parameters_;
  Stages stages_;
  std::optional<support::FieldOracle> oracle_;
};

TEST_P(FieldOracleTest, EveryNodeIsOnTheSideThatTheEquationsSay) {
  const LevelSet& level_set = stages_.level_set;
  for (std::size_t tile = 0; tile < stages_.bins.tiles.size(); ++tile) {
    for (int node = 0; node < kTileNodes; ++node) {
      const int i = node % kTileSize;
      const int j = node / kTileSize;
      const support::Vector at = Node(tile, i, j);
      const double expected = oracle_->Value(at);
      const float value = level_set.tiles[tile][node];
      EXPECT_EQ((level_set.inside[tile][j] >> i & 1) != 0, value < 0);
      if (std::abs(expected) < Tolerance(at)) continue;
      ASSERT_EQ(value < 0, expected < 0) << "node (" << at.x << ", " << at.y << ")";
    }
  }
}

TEST_P(FieldOracleTest, BothEndsOfEveryCrossedEdgeAgreeWithTheEquations) {
  int checked = 0;
  const auto check = [&](std::size_t tile, int i, int j) {
    const support::Vector at = Node(tile, i, j);
    const double tolerance = Tolerance(at);
    if (tolerance > 0.1 * parameters_.kernel_radius) return;
    ++checked;
    ASSERT_NEAR(stages_.level_set.At(stages_.bins.tiles, static_cast<std::uint32_t>(tile), i, j) *
                    parameters_.cell_size,
                oracle_->Value(at), tolerance)
        << "kernel radius " << parameters_.kernel_radius << ", cell " << parameters_.cell_size
        << ", node (" << at.x << ", " << at.y << "), kernel sum " << oracle_->KernelSum(at);
  };
  for (std::uint32_t tile = 0; tile < stages_.bins.tiles.size(); ++tile) {
    for (int node = 0; node < kTileNodes; ++node) {
      const int i = node % kTileSize;
      const int j = node / kTileSize;
      const auto is_inside = [&](int di, int dj) {
        return stages_.level_set.At(stages_.bins.tiles, tile, i + di, j + dj) < 0;
      };
      for (const auto& [di, dj] : {std::pair(1, 0), std::pair(0, 1)}) {
        if (is_inside(0, 0) == is_inside(di, dj)) continue;
        check(tile, i, j);
        check(tile, i + di, j + dj);
      }
    }
  }
  EXPECT_GT(checked, 10);
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
  // Where neither the guard nor the gap are above it, phi is the distance less r.
  EXPECT_NEAR(stages.level_set.At(stages.bins.tiles, tile, 1, 0), 1 - stages.scale.reference_radius,
              1e-6);
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

TEST(Field, OnlyTheBoundaryOfALatticeIsNearZero) {
  Stages stages;
  stages.Run(support::Lattice(21, 21), {.spacing = 1.0});
  const std::uint32_t tile = stages.bins.tiles.Find({0, 0});
  // By the density alone: the mean is not asked there.
  EXPECT_NEAR(stages.level_set.At(stages.bins.tiles, tile, 10, 10), (0.85 - 1) * 3 / 1.164, 0.01);
}

BitRows SomeNodes(support::Random& random, std::size_t in_row) {
  BitRows nodes{};
  for (std::uint32_t& row : nodes) {
    for (std::size_t n = random.Below(in_row + 1); n > 0; --n) {
      row |= std::uint32_t{1} << random.Below(kTileSize);
    }
  }
  return nodes;
}

TEST(NodeBlocks, HaveEachAskedNodeOnceAndNoOther) {
  support::Random random(17);
  for (std::size_t in_row : {0, 1, 2, 5, 60}) {
    const BitRows asked = SomeNodes(random, in_row);
    const NodeBlocks blocks = BlocksOf(asked);
    BitRows seen{};
    for (int b = 0; b < blocks.count; ++b) {
      const NodeBlock& block = blocks[b];
      EXPECT_NE(block.asked, 0);
      ASSERT_LE(std::max(block.column, block.row) + NodeBlock::kSide, kTileSize);
      for (int node = 0; node < NodeBlock::kNodes; ++node) {
        if ((block.asked >> node & 1) == 0) continue;
        std::uint32_t& row = seen[block.row + node / NodeBlock::kSide];
        const std::uint32_t bit = 1u << (block.column + node % NodeBlock::kSide);
        EXPECT_EQ(row & bit, 0u);
        row |= bit;
      }
    }
    EXPECT_EQ(seen, asked);
  }
}

TEST(NearMoments, AreThoseOfAllParticlesAtEachAskedNodeForAnyRadius) {
  support::Random random(18);
  for (const float radius : {0.5f, 1.5f, 3.0f, 11.2f, 31.5f}) {
    ParticleBlock near;
    for (near.count = 0; near.count < 200; ++near.count) {
      near.x[near.count] = static_cast<float>(random.Uniform(-20, 52));
      near.y[near.count] = static_cast<float>(random.Uniform(-20, 52));
    }
    const NodeBlocks blocks = BlocksOf(SomeNodes(random, 3));
    support::ForEachInstructionSet([&] {
      MomentSums sums{};
      AddNearMoments(near, false, radius, blocks, false, sums);
      for (int b = 0; b < blocks.count; ++b) {
        for (int node = 0; node < NodeBlock::kNodes; ++node) {
          const int column = blocks[b].column + node % NodeBlock::kSide;
          const int row = blocks[b].row + node / NodeBlock::kSide;
          double kernel = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
          for (int e = 0; e < near.count; ++e) {
            const double dx = double{near.x[e]} - column, dy = double{near.y[e]} - row;
            const double t = std::max(0.0, 1 - (dx * dx + dy * dy) / (double{radius} * radius));
            const double k = t * t * t;
            kernel += k;
            x += k * dx;
            y += k * dy;
            xx += k * dx * dx;
            xy += k * dx * dy;
            yy += k * dy * dy;
          }
          const double tolerance = 1e-5 * radius * (1 + kernel);
          EXPECT_NEAR(sums[b].kernel[node], kernel, tolerance);
          EXPECT_NEAR(sums[b].moment_x[node], x, tolerance);
          EXPECT_NEAR(sums[b].moment_y[node], y, tolerance);
          EXPECT_NEAR(sums[b].xx[node], xx, tolerance * radius);
          EXPECT_NEAR(sums[b].xy[node], xy, tolerance * radius);
          EXPECT_NEAR(sums[b].yy[node], yy, tolerance * radius);
        }
      }
    });
  }
}

// Vectors read beyond them: no bit may depend on it, and no conversion of it may be undefined.
TEST(NearMoments, DoNotDependOnWhatLiesBehindTheLastParticle) {
  BitRows all;
  all.fill(~std::uint32_t{0});
  const NodeBlocks blocks = BlocksOf(all);
  const auto moments_with = [&](float behind) {
    ParticleBlock near;
    near.x.fill(behind);
    near.y.fill(behind);
    near.count = 3;
    for (int k = 0; k < near.count; ++k) near.x[k] = near.y[k] = 4.25f * static_cast<float>(k);
    MomentSums sums{};
    AddNearMoments(near, false, 2.5f, blocks, false, sums);
    std::vector<float> at_nodes;
    for (int b = 0; b < blocks.count; ++b) {
      for (const auto& channel : {sums[b].kernel, sums[b].xy}) {
        at_nodes.insert(at_nodes.end(), channel.begin(), channel.end());
      }
    }
    return at_nodes;
  };
  support::ForEachInstructionSet([&] {
    const std::vector<float> expected = moments_with(0);
    EXPECT_EQ(moments_with(1e30f), expected);
    EXPECT_EQ(moments_with(std::numeric_limits<float>::quiet_NaN()), expected);
  });
}

// Processors differ in their vectors: each kind that this one has must give the bits of all others.
TEST(Field, HasTheSameBitsForAnyInstructionSet) {
  support::Random random(9);
  for (const double radius : {1.5, 2.0, 3.0, 4.0, 5.7, 8.0, 20.0}) {
    support::Particles particles = SmallScene(random, 1.0, radius > 3);
    std::vector<LevelSet> results;
    support::ForEachInstructionSet([&] {
      Stages stages;
      stages.Run(particles, {.spacing = 1.0, .kernel_radius = radius});
      results.push_back(stages.level_set);
    });
    ASSERT_FALSE(results.empty());
    for (const LevelSet& result : results) {
      EXPECT_EQ(result.inside, results[0].inside);
      ASSERT_EQ(result.tiles.size(), results[0].tiles.size());
      EXPECT_EQ(std::memcmp(result.tiles.data(), results[0].tiles.data(),
                            result.tiles.size() * sizeof(result.tiles[0])),
                0);
    }
  }
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

// F at a node of the plane.
float ValueAt(const Stages& stages, int column, int row) {
  const std::uint32_t tile = stages.bins.tiles.Find({row >> kTileShift, column >> kTileShift});
  if (tile == kNoTile) return stages.level_set.void_value;
  return stages.level_set.At(stages.bins.tiles, tile, column & 31, row & 31);
}

// Whether a neighbour of the node is on the other side.
bool IsEndOfCrossedEdge(const Stages& stages, int column, int row) {
  const bool is_inside = ValueAt(stages, column, row) < 0;
  constexpr std::pair<int, int> kNeighbours[] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  return std::any_of(std::begin(kNeighbours), std::end(kNeighbours), [&](const auto& to) {
    return (ValueAt(stages, column + to.first, row + to.second) < 0) != is_inside;
  });
}

// Sums run tile by tile, so that a shift by whole tiles changes no bit, and one by whole cells the
// last ones only.
TEST(Field, AShiftByWholeCellsShiftsItWhereTheIsolineCrossesAnEdge) {
  support::Random random(4);
  const support::Particles particles = support::Snapped(support::Blob(random, 8), 1.0);
  Stages here;
  here.Run(particles, {.spacing = 1.0});
  for (const auto& [dx, dy] :
       {std::pair(32, 0), std::pair(-64, 96), std::pair(32'000'032, -3200), std::pair(1, 0),
        std::pair(-7, 19), std::pair(1'000'003, -999'983)}) {
    const bool by_tiles = dx % kTileSize == 0 && dy % kTileSize == 0;
    Stages there;
    there.Run(support::Shifted(particles, dx, dy), {.spacing = 1.0});
    int ends = 0;
    for (int y = -15; y <= 15; ++y) {
      for (int x = -15; x <= 15; ++x) {
        const float expected = ValueAt(here, x, y);
        const float shifted = ValueAt(there, x + dx, y + dy);
        EXPECT_EQ(shifted < 0, expected < 0) << x << ", " << y;
        EXPECT_NEAR(shifted, expected, by_tiles ? 0 : 1e-5) << x << ", " << y;
        ends += IsEndOfCrossedEdge(here, x, y);
      }
    }
    EXPECT_GT(ends, 100);
  }
}

// Where particles are few, the isoline passes between nodes of which the density has decided one.
TEST(Field, EndsOfCrossedEdgesDecidedByDensityMatchTheEquations) {
  support::Random random(5);
  int checked = 0;
  for (const double radius : {1.5, 2.0, 3.0}) {
    Stages stages;
    stages.Run(support::Snapped(support::Noise(random, 60, 14), 1.0),
               {.spacing = 1.0, .kernel_radius = radius});
    const support::FieldOracle oracle(stages.particles, stages.parameters, 1.0);
    for (int y = -16; y <= 16; ++y) {
      for (int x = -16; x <= 16; ++x) {
        const std::uint32_t tile = stages.bins.tiles.Find({y >> kTileShift, x >> kTileShift});
        if (tile == kNoTile || !IsEndOfCrossedEdge(stages, x, y)) continue;
        const bool is_open = (stages.level_set.open[tile][y & 31] >> (x & 31) & 1) != 0;
        const support::Vector at{double(x), double(y)};
        if (is_open || oracle.KernelSum(at) < 1e-3) continue;
        ASSERT_NEAR(ValueAt(stages, x, y), oracle.Value(at), 1e-5 * radius) << x << ", " << y;
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 10);
}

// Two half-planes of particles, a gap between their boundaries: the mean of the particles alone
// sees an inside half-way across it as long as any kernel reaches both.
TEST(Field, ABodyEndsAtAGapOfTwoSpacingsAndGoesOnAcrossOneOfHalfASpacing) {
  for (const double gap : {0.5, 2.0, 2.5, 3.0}) {
    support::Particles particles = support::Lattice(20, 6, 0, -6);
    particles.Add(support::Lattice(20, 6, 0, gap));
    Stages stages;
    stages.Run(particles, {.spacing = 1.0, .cell_size = 0.25});
    const double middle = 4 * (-1 + gap) / 2;  // Between the centres at -1 and at `gap`, in cells.
    const int column = 4 * 10;
    const int row = static_cast<int>(std::lround(middle));
    const TileCoordinate place{row >> 5, column >> 5};
    const float value = stages.level_set.At(stages.bins.tiles, stages.bins.tiles.Find(place),
                                            column & 31, row & 31);
    if (gap < 1) {
      EXPECT_LT(value, 0) << gap;
    } else {
      EXPECT_GT(value, 0) << gap;
    }
  }
}

}  // namespace
}  // namespace partiemc
