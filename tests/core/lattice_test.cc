#include "bins/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "support/random.h"

namespace partiemc {
namespace {

TEST(Lattice, TilesComeSortedByRowThenColumnAndEachOnce) {
  support::Random random(1);
  TileDirectory directory;
  std::set<TileCoordinate> expected;
  for (int k = 0; k < 2000; ++k) {
    const TileCoordinate tile{static_cast<std::int32_t>(random.Below(40)) - 20,
                              static_cast<std::int32_t>(random.Below(40)) - 20};
    directory.Insert(tile);
    expected.insert(tile);
  }
  directory.Seal();
  EXPECT_TRUE(std::equal(directory.tiles().begin(), directory.tiles().end(), expected.begin(),
                         expected.end()));
}

TEST(Lattice, EveryTileFindsItselfAndItsEightNeighbours) {
  support::Random random(2);
  TileDirectory directory;
  for (int k = 0; k < 300; ++k) {
    directory.Insert({static_cast<std::int32_t>(random.Below(20)),
                      static_cast<std::int32_t>(random.Below(20)) - 10});
  }
  directory.Seal();
  for (std::uint32_t tile = 0; tile < directory.size(); ++tile) {
    const TileCoordinate at = directory[tile];
    EXPECT_EQ(directory.Find(at), tile);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const std::uint32_t near = directory.neighbours(tile)[(dy + 1) * 3 + dx + 1];
        const TileCoordinate wanted{at.y + dy, at.x + dx};
        const auto it = std::find(directory.tiles().begin(), directory.tiles().end(), wanted);
        if (it == directory.tiles().end()) {
          EXPECT_EQ(near, kNoTile);
        } else {
          EXPECT_EQ(near, static_cast<std::uint32_t>(it - directory.tiles().begin()));
        }
      }
    }
  }
}

TEST(Lattice, AnEmptyDirectoryFindsNothing) {
  TileDirectory directory;
  EXPECT_EQ(directory.Find({0, 0}), kNoTile);
  directory.Seal();
  EXPECT_EQ(directory.size(), 0u);
  EXPECT_EQ(directory.Find({0, 0}), kNoTile);
}

TEST(Lattice, AClearedDirectoryForgetsItsTiles) {
  TileDirectory directory;
  for (std::int32_t k = 0; k < 100; ++k) directory.Insert({k, -k});
  directory.Seal();
  directory.Clear();
  EXPECT_EQ(directory.size(), 0u);
  EXPECT_EQ(directory.Find({3, -3}), kNoTile);
  directory.Insert({7, 7});
  directory.Seal();
  EXPECT_EQ(directory.size(), 1u);
  EXPECT_EQ(directory.Find({7, 7}), 0u);
  EXPECT_EQ(directory.Find({3, -3}), kNoTile);
}

TEST(Lattice, APlaceOutsideATileIsFoundInItsNeighbour) {
  TileDirectory directory;
  for (std::int32_t y = -1; y <= 1; ++y) {
    for (std::int32_t x = -1; x <= 1; ++x) directory.Insert({y, x});
  }
  directory.Seal();
  const std::uint32_t middle = directory.Find({0, 0});
  for (int j = -kTileSize; j < 2 * kTileSize; ++j) {
    for (int i = -kTileSize; i < 2 * kTileSize; ++i) {
      const TilePlace place = Normalise(directory, middle, i, j);
      ASSERT_NE(place.tile, kNoTile);
      EXPECT_EQ(directory[place.tile].x * kTileSize + place.i, i);
      EXPECT_EQ(directory[place.tile].y * kTileSize + place.j, j);
    }
  }
  const std::uint32_t corner = directory.Find({1, 1});
  EXPECT_EQ(Normalise(directory, corner, kTileSize, 0).tile, kNoTile);
}

}  // namespace
}  // namespace partiemc
