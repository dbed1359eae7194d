#include "mesh/node_vertices.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "support/random.h"

namespace partiemc {
namespace {

TEST(NodeVertices, AreNumberedByTileRowColumn) {
  support::Random random(12);
  NodeVertices nodes;
  for (int round = 0; round < 50; ++round) {
    TileDirectory directory;
    for (int k = 0; k < 5; ++k) {
      directory.Insert({static_cast<std::int32_t>(random.Uniform(-9, 9)),
                        static_cast<std::int32_t>(random.Uniform(-9, 9))});
    }
    directory.Seal();
    const double cell_size = random.Uniform(0.1, 2);
    // Their numbers are expected in the order of these keys.
    std::map<std::pair<std::uint32_t, int>, TilePlace> expected;
    nodes.Clear(directory.size());
    for (int k = 0; k < 1 << round % 11; ++k) {
      const auto tile = static_cast<std::uint32_t>(random.Below(directory.size()));
      const auto node = static_cast<int>(random.Below(kTileNodes));
      const TilePlace place{tile, node % kTileSize, node / kTileSize};
      nodes.Add(place);
      expected[{tile, node}] = place;
    }
    std::vector<double> points{1, 2, 3, 4};
    nodes.Number(2);
    nodes.AppendPoints(directory, cell_size, points);
    ASSERT_EQ(points.size(), 4 + 2 * expected.size()) << "seed 12, round " << round;
    EXPECT_EQ(points[3], 4);
    std::uint32_t number = 2;
    for (const auto& [key, place] : expected) {
      ASSERT_EQ(nodes.At(place), number) << "seed 12, round " << round;
      const TileCoordinate& tile = directory[place.tile];
      EXPECT_EQ(points[2 * number], (kTileSize * tile.x + place.i) * cell_size);
      EXPECT_EQ(points[2 * number + 1], (kTileSize * tile.y + place.j) * cell_size);
      ++number;
    }
  }
}

}  // namespace
}  // namespace partiemc
