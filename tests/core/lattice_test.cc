#include "bins/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>

#include "space/lattice.h"
#include "support/random.h"
#include "vertices/hierarchical_grid.h"

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

// Counts the slots that keys occupy in a table of kSlots. The keys are chosen: in the table with
// the hash `known`, which an attacker knows, all of them had the same slot.
constexpr std::size_t kSlots = 4096, kChosen = 1024;

template <typename Known, typename Hash>
std::size_t SlotsOfChosen(const Known& known, const Hash& hash) {
  std::set<std::size_t> slots;
  std::size_t chosen = 0;
  for (std::uint64_t key = 0; chosen < kChosen; ++key) {
    const auto a = static_cast<std::int32_t>(key % 4096), b = static_cast<std::int32_t>(key / 4096);
    if (known(a, b) % kSlots != 0) continue;
    ++chosen;
    slots.insert(hash(a, b) % kSlots);
  }
  return slots.size();
}

TEST(Lattice, ChosenCoordinatesDoNotCollide) {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;
  const auto pair = [](std::int32_t a, std::int32_t b) {
    return static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b);
  };
  const auto known_tile = [&](std::int32_t y, std::int32_t x) {
    const std::uint64_t key = pair(y, x) * kGolden;
    return key ^ key >> 29;
  };
  const auto known_brick = [](std::int32_t y, std::int32_t x) {
    const std::uint64_t key =
        (static_cast<std::uint64_t>(x) * kGolden + static_cast<std::uint64_t>(y)) * kGolden *
        kGolden;
    return key ^ key >> 29;
  };
  const auto known_cell = [&](std::int32_t row, std::int32_t column) {
    return HierarchicalGrid::Key(1, column, row) * kGolden >> 32;
  };
  // Of 4,096 slots, 1,024 random ones are 906 different ones.
  EXPECT_GT(SlotsOfChosen(known_tile,
                          [](std::int32_t y, std::int32_t x) {
                            return TileDirectory::HashOf({y, x});
                          }),
            800u);
  EXPECT_GT(SlotsOfChosen(known_brick,
                          [](std::int32_t y, std::int32_t x) {
                            return space::BrickDirectory::HashOf({0, y, x});
                          }),
            800u);
  EXPECT_GT(SlotsOfChosen(known_cell,
                          [](std::int32_t row, std::int32_t column) {
                            return SlotOf(HierarchicalGrid::Key(1, column, row), kSlots);
                          }),
            800u);
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
