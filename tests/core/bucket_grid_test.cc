#include "bucket_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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
    BucketBox box = grid.All();
    if (random.Chance(0.5)) box = {.column = -3, .row = 2, .columns = 7, .rows = 1};
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
      grid.Find(near, box, buckets);
      for (int k = 0; k < near.count; ++k) {
        const int row = grid.Along(near.y[k]) - box.row;
        const int column = grid.Along(near.x[k]) - box.column;
        ASSERT_EQ(buckets[k], row * box.columns + column)
            << "radius " << radius << " at " << near.x[k] << ", " << near.y[k];
      }
    });
  }
}

TEST(BucketGrid, TheBoxAroundAMaskHasItsCellsAndNoSideWithoutThem) {
  support::Random random(2);
  for (int round = 0; round < 500; ++round) {
    const BucketGrid grid(random.Chance(0.5) ? 3 : random.Uniform(0.3, 15));
    CellMask mask{};
    std::vector<std::pair<int, int>> cells;  // Column and row, relative to the tile.
    for (auto left = 1 + random.Below(5); left > 0; --left) {
      const auto column = static_cast<int>(random.Below(64));
      const auto row = static_cast<int>(random.Below(64));
      mask[row] |= std::uint64_t{1} << column;
      cells.push_back({column - kMaskMargin, row - kMaskMargin});
    }
    int columns[2] = {1000, -1000}, rows[2] = {1000, -1000};
    for (const auto& [column, row] : cells) {
      columns[0] = std::min(columns[0], grid.Along(column));
      columns[1] = std::max(columns[1], grid.Along(column + 1 - kStep));
      rows[0] = std::min(rows[0], grid.Along(row));
      rows[1] = std::max(rows[1], grid.Along(row + 1 - kStep));
    }
    const BucketBox box = grid.Around(mask);
    EXPECT_EQ(box.column, columns[0]);
    EXPECT_EQ(box.row, rows[0]);
    EXPECT_EQ(box.columns, columns[1] - columns[0] + 1);
    EXPECT_EQ(box.rows, rows[1] - rows[0] + 1);
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

}  // namespace
}  // namespace partiemc
