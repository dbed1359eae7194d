#include "bucket_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/instruction_sets.h"
#include "support/particles.h"

namespace partiemc {
namespace {

constexpr double kStep = 1.0 / (1 << 17);  // Of positions.

TEST(BucketGrid, FindsTheBucketsOfManyEntriesAsOfOneOnEveryInstructionSet) {
  support::Random random(1);
  for (int round = 0; round < 200; ++round) {
    const double radius = random.Chance(0.3) ? 3 : random.Uniform(0.3, 30);
    const BucketGrid grid(radius);
    NearEntries near;
    near.count = static_cast<int>(random.Below(NearEntries::kCapacity + 1));
    for (int k = 0; k < near.count; ++k) {
      // Some on the sides of cells; some farther out than the margin, as cells that a mask names
      // are.
      const auto coordinate = [&] {
        const double at = random.Uniform(-radius - 1, kTileSize + radius + 1);
        return static_cast<float>(random.Chance(0.2) ? std::round(at)
                                                     : std::round(at / kStep) * kStep);
      };
      near.x[k] = coordinate();
      near.y[k] = coordinate();
    }
    support::ForEachInstructionSet([&] {
      BucketGrid::Buckets buckets;
      grid.Find(near, buckets);
      for (int k = 0; k < near.count; ++k) {
        const int bucket = grid.Along(near.y[k]) * grid.columns() + grid.Along(near.x[k]);
        ASSERT_EQ(buckets[k], bucket)
            << "radius " << radius << " at " << near.x[k] << ", " << near.y[k];
        ASSERT_LT(static_cast<std::uint32_t>(bucket), grid.count());
      }
    });
  }
}

TEST(BucketGrid, ABucketReachesNoFartherThanAQuarterOfAKernelOrACell) {
  for (const double radius : {0.5, 1.0, 3.0, 4.0, 7.3, 29.0}) {
    const BucketGrid grid(radius);
    const double width = std::max(1.0, radius / 4) + kStep;
    for (double at = -radius; at + width < kTileSize + radius; at += 0.37) {
      EXPECT_LT(grid.Along(at), grid.Along(at + width)) << "radius " << radius << " at " << at;
    }
  }
}

TEST(BucketGrid, KeepsTilesApartWhereNoBucketReachesAcrossTheirSides) {
  EXPECT_TRUE(BucketGrid(2).KeepsTilesApart());
  EXPECT_TRUE(BucketGrid(3).KeepsTilesApart());
  EXPECT_TRUE(BucketGrid(8).KeepsTilesApart());  // Buckets of two cells.
  EXPECT_FALSE(BucketGrid(2.5).KeepsTilesApart());
  EXPECT_FALSE(BucketGrid(std::nextafter(3.0, 2.0)).KeepsTilesApart());  // By less than a step.
  EXPECT_FALSE(BucketGrid(7).KeepsTilesApart());
}

}  // namespace
}  // namespace partiemc
