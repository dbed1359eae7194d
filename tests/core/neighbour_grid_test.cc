#include "sampler/neighbour_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

constexpr double kStep = NeighbourGrid::kStep;

TEST(GridAxis, DividesATileAndItsNeighboursAlike) {
  support::Random random(1);
  for (int round = 0; round < support::Tries(2000); ++round) {
    const GridAxis axis(random.Uniform(0, 40));
    // Some on the sides of cells.
    const double at = random.Uniform(-kTileSize, 2 * kTileSize);
    const double coordinate = random.Chance(0.2) ? std::floor(at) : std::floor(at / kStep) * kStep;
    const double tile = std::floor(coordinate / kTileSize);
    const auto inside = static_cast<float>(coordinate - tile * kTileSize);
    const int place = axis.TileOf(axis.Along(coordinate));
    ASSERT_EQ(place, static_cast<int>(tile) + 1) << coordinate;
    ASSERT_EQ(axis.Along(coordinate), place * axis.size() + static_cast<int>(axis.InTile(inside)));
    ASSERT_LT(axis.InTile(inside), static_cast<std::uint32_t>(axis.size()));
  }
}

TEST(GridAxis, CountsWhatIsFartherOutToTheOutermostBuckets) {
  for (const double width : {0.0, 2.0, 7.0, 64.0}) {
    const GridAxis axis(width);
    EXPECT_EQ(axis.Along(-kTileSize - kStep), 0);
    EXPECT_EQ(axis.Along(2 * kTileSize), 3 * axis.size() - 1);
  }
}

TEST(GridAxis, BucketsAreAsWideAsAskedRoundedDownToAPowerOfTwoOfCells) {
  for (const double width : {0.0, 0.9, 1.0, 1.9, 2.0, 3.9, 4.0, 8.5, 31.9, 32.0, 90.0}) {
    const GridAxis axis(width);
    const int cells = kTileSize / axis.size();
    EXPECT_EQ(cells * axis.size(), kTileSize);
    EXPECT_LE(cells, std::max(1.0, width));
    EXPECT_GT(cells, std::min<double>(width, kTileSize) / 2);
  }
}

}  // namespace
}  // namespace partiemc
