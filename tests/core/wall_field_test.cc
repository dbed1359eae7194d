#include "walls/wall_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bins/lattice.h"
#include "partiemc/parameters.h"

namespace partiemc {
namespace {

// The fluid lies above the tangents of a parabola. The row of tiles crosses it twice, where tiles
// are near some tangents and behind others.
TEST(WallField, TilesBehindOneOfManyEndlessWallsAreSolid) {
  constexpr int kTiles = 1500;
  constexpr int kWalls = 41;
  std::vector<Wall> walls;
  for (int k = 0; k < kWalls; ++k) {
    const double x = 2400.0 * (k - kWalls / 2), slope = x / 1440'000;
    const double y = 200 * (x / 24'000 * (x / 24'000) - 1);
    walls.push_back({{x, y, x + 1000, y + 1000 * slope}});
  }
  TileDirectory directory;
  for (int x = -kTiles; x < kTiles; ++x) directory.Insert({0, x});
  directory.Seal();
  WallField field;
  field.ListLines({walls}, 1, directory);
  field.FindTiles(directory);

  std::size_t fluid = 0, near = 0, solid = 0, both = 0;
  for (std::uint32_t tile = 0; tile < directory.size(); ++tile) {
    const double left = 32.0 * directory[tile].x;
    std::size_t lines = 0;
    bool is_behind = false;
    for (const Wall& wall : walls) {
      const double slope = (wall.points[3] - wall.points[1]) / 1000;
      const auto height = [&](double x, double y) {
        return (y - wall.points[1] - slope * (x - wall.points[0])) / std::hypot(1, slope);
      };
      const bool is_near = std::abs(height(left + 16, 16)) <= 32 * .7072 + WallField::kMostHeight;
      lines += is_near;
      is_behind |= !is_near && height(left, 0) < 0;
    }
    if (is_behind) {
      EXPECT_EQ(field.HeightAt({tile, 0, 0}), -WallField::kMostHeight) << left;
      EXPECT_TRUE(field.EdgesNear(tile).empty()) << left;
    } else {
      EXPECT_EQ(field.EdgesNear(tile).size(), lines) << left;
      if (lines == 0) {
        EXPECT_EQ(field.HeightAt({tile, 0, 0}), WallField::kMostHeight) << left;
      }
    }
    both += is_behind && lines > 0;
    ++(is_behind ? solid : lines > 0 ? near : fluid);
  }
  EXPECT_GT(fluid, 100u);
  EXPECT_GT(near, 10u);
  EXPECT_GT(solid, 100u);
  EXPECT_GT(both, 10u);
}

}  // namespace
}  // namespace partiemc
