#include "crossings/crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "support/oracle.h"
#include "support/random.h"
#include "support/stages.h"

namespace partiemc {
namespace {

enum Edge { kBottom = 0, kRight = 1, kTop = 2, kLeft = 3 };

// A level set on tiles [low, high], with values of `function` at nodes (column, row).
struct Contour {
  TileDirectory tiles;
  LevelSet level_set;
  Crossings crossings;

  Contour(const std::function<double(int, int)>& function, TileCoordinate low,
          TileCoordinate high) {
    for (std::int32_t y = low.y; y <= high.y; ++y) {
      for (std::int32_t x = low.x; x <= high.x; ++x) tiles.Insert({y, x});
    }
    tiles.Seal();
    level_set = support::LevelSetOf(function, tiles);
    FindCrossings(tiles, level_set, crossings);
  }

  // Column and row of a cell.
  std::pair<int, int> Place(const ActiveCell& cell) const {
    return {32 * tiles[cell.tile].x + cell.i, 32 * tiles[cell.tile].y + cell.j};
  }

  std::vector<std::pair<int, int>> SegmentsOf(const ActiveCell& cell) const {
    std::vector<std::pair<int, int>> segments;
    for (std::uint32_t k = 0; k < (cell.IsSaddle() ? 2u : 1u); ++k) {
      const Segment& segment = crossings.segments[cell.first_segment + k];
      EXPECT_EQ(&crossings.cells[segment.cell], &cell);
      segments.emplace_back(segment.entry, segment.exit);
    }
    std::sort(segments.begin(), segments.end());
    return segments;
  }

  // The active cell at a place, or nullptr.
  const ActiveCell* CellOn(int column, int row) const {
    for (const ActiveCell& cell : crossings.cells) {
      if (Place(cell) == std::pair(column, row)) return &cell;
    }
    return nullptr;
  }
};

// One cell at (10, 10) with the given corner values, everything else outside.
Contour OneCell(std::array<double, 4> corners) {
  return Contour(
      [&](int x, int y) {
        if (x == 10 && y == 10) return corners[0];
        if (x == 11 && y == 10) return corners[1];
        if (x == 11 && y == 11) return corners[2];
        if (x == 10 && y == 11) return corners[3];
        return 1.0;
      },
      {0, 0}, {0, 0});
}

std::array<double, 4> CornersOf(unsigned inside) {
  std::array<double, 4> corners;
  for (unsigned k = 0; k < 4; ++k) corners[k] = inside >> k & 1 ? -1 : 1;
  return corners;
}

TEST(Crossings, SegmentsOfAllFourteenCasesHaveTheInsideOnTheLeft) {
  // Drawn by hand: '#' inside, 'o' outside, lower row second.
  const std::map<unsigned, std::pair<int, int>> expected = {
      {1, {kBottom, kLeft}},    // oo / #o
      {2, {kRight, kBottom}},   // oo / o#
      {3, {kRight, kLeft}},     // oo / ##
      {4, {kTop, kRight}},      // o# / oo
      {6, {kTop, kBottom}},     // o# / o#
      {7, {kTop, kLeft}},       // o# / ##
      {8, {kLeft, kTop}},       // #o / oo
      {9, {kBottom, kTop}},     // #o / #o
      {11, {kRight, kTop}},     // #o / ##
      {12, {kLeft, kRight}},    // ## / oo
      {13, {kBottom, kRight}},  // ## / #o
      {14, {kLeft, kBottom}},   // ## / o#
  };
  for (const auto& [inside, segment] : expected) {
    const Contour contour = OneCell(CornersOf(inside));
    const ActiveCell* cell = contour.CellOn(10, 10);
    ASSERT_NE(cell, nullptr) << "case " << inside;
    EXPECT_EQ(cell->corners, inside);
    EXPECT_EQ(contour.SegmentsOf(*cell), std::vector{segment}) << "case " << inside;
  }
}

TEST(Crossings, BothSaddlesAreJoinedOrPartedByTheSignOfTheirStationaryValue) {
  struct Saddle {
    std::array<double, 4> corners;
    std::vector<std::pair<int, int>> segments;
  };
  const Saddle saddles[] = {
      // Corners 0 and 2 deep inside: joined, the segments cut corners 1 and 3 off.
      {{-3, 1, -3, 1}, {{kBottom, kRight}, {kTop, kLeft}}},
      {{-1, 3, -1, 3}, {{kBottom, kLeft}, {kTop, kRight}}},
      {{1, -3, 1, -3}, {{kRight, kTop}, {kLeft, kBottom}}},
      {{3, -1, 3, -1}, {{kRight, kBottom}, {kLeft, kTop}}},
      // A stationary value of exactly 0 counts as outside, so the corners are separated.
      {{-1, 1, -1, 1}, {{kBottom, kLeft}, {kTop, kRight}}},
      {{1, -1, 1, -1}, {{kRight, kBottom}, {kLeft, kTop}}},
      // Lopsided: -2 * -1 against 1 * 1.9 and 1 * 2.1.
      {{-2, 1, -1, 1.9}, {{kBottom, kRight}, {kTop, kLeft}}},
      {{-2, 1, -1, 2.1}, {{kBottom, kLeft}, {kTop, kRight}}},
  };
  for (Saddle saddle : saddles) {
    const Contour contour = OneCell(saddle.corners);
    const ActiveCell* cell = contour.CellOn(10, 10);
    ASSERT_NE(cell, nullptr);
    ASSERT_TRUE(cell->IsSaddle());
    std::sort(saddle.segments.begin(), saddle.segments.end());
    EXPECT_EQ(contour.SegmentsOf(*cell), saddle.segments) << testing::PrintToString(saddle.corners);
  }
}

TEST(Crossings, UniformCellsAreNotActive) {
  EXPECT_TRUE(OneCell(CornersOf(0)).crossings.cells.empty());
  const Contour full = OneCell(CornersOf(15));
  EXPECT_EQ(full.CellOn(10, 10), nullptr);
  EXPECT_EQ(full.crossings.cells.size(), 8u);  // Those around it.
  EXPECT_EQ(full.crossings.interior[0][10], std::uint32_t{1} << 10);
}

TEST(Crossings, AValueOfExactlyZeroIsOutside) {
  for (const double zero : {0.0, -0.0}) {
    EXPECT_TRUE(OneCell({zero, zero, zero, zero}).crossings.cells.empty());
    const Contour contour = OneCell({-1, zero, zero, zero});
    EXPECT_EQ(contour.CellOn(10, 10)->corners, 1);
    // The isoline stays off the node, though the value there is 0.
    const ActiveCell& cell = *contour.CellOn(10, 10);
    const Point crossing = EdgeCrossing(contour.tiles, contour.level_set, cell, kBottom);
    EXPECT_GT(crossing.x, 10.5);
    EXPECT_LT(crossing.x, 11);
  }
}

TEST(Crossings, AnEdgeIsCrossedWhereTheLinearInterpolantIsZero) {
  const Contour contour = OneCell({-1, 3, 1, 0.25});
  const ActiveCell& cell = *contour.CellOn(10, 10);
  const Point bottom = EdgeCrossing(contour.tiles, contour.level_set, cell, kBottom);
  EXPECT_DOUBLE_EQ(bottom.x, 10.25);
  EXPECT_DOUBLE_EQ(bottom.y, 10);
  const Point left = EdgeCrossing(contour.tiles, contour.level_set, cell, kLeft);
  EXPECT_DOUBLE_EQ(left.x, 10);
  EXPECT_DOUBLE_EQ(left.y, 10.8);
}

// Random values of both signs, with zeros, large and tiny ones among them; outside at the rim.
std::function<double(int, int)> RandomField(std::uint64_t seed, int low_x, int low_y, int high_x,
                                            int high_y) {
  return [=](int x, int y) {
    if (x <= low_x || y <= low_y || x >= high_x || y >= high_y) return 1.0;
    support::Random random(seed ^ static_cast<std::uint64_t>(x * 100003 + y));
    random.Bits();
    if (random.Chance(0.05)) return 0.0;
    return random.Uniform(-1, 1) * std::pow(10, random.Uniform(-6, 3));
  };
}

class RandomCrossings : public testing::TestWithParam<int> {
 protected:
  Contour contour_{
      RandomField(static_cast<std::uint64_t>(GetParam()), -31, -31, 62, 30), {-1, -1}, {0, 1}};
};

TEST_P(RandomCrossings, EveryCellHasTheSegmentsOfTheOracle) {
  const auto function = RandomField(static_cast<std::uint64_t>(GetParam()), -31, -31, 62, 30);
  std::size_t active = 0;
  for (int row = -32; row < 32; ++row) {
    for (int column = -32; column < 64; ++column) {
      const auto value = [&](int x, int y) {
        // As the level set keeps it.
        return static_cast<double>(static_cast<float>(function(x, y)));
      };
      auto expected = support::CellSegments({value(column, row), value(column + 1, row),
                                             value(column + 1, row + 1), value(column, row + 1)});
      std::sort(expected.begin(), expected.end());
      const std::uint32_t tile = contour_.tiles.Find({row >> kTileShift, column >> kTileShift});
      const bool is_active = contour_.crossings.tiles[tile].active[row & 31] >> (column & 31) & 1;
      ASSERT_EQ(is_active, !expected.empty()) << column << ", " << row;
      if (!is_active) continue;
      const std::uint32_t index = CellAt(contour_.crossings, {tile, column & 31, row & 31});
      const ActiveCell& cell = contour_.crossings.cells[index];
      EXPECT_EQ(contour_.Place(cell), std::pair(column, row));
      EXPECT_EQ(contour_.SegmentsOf(cell), expected) << column << ", " << row;
      ++active;
    }
  }
  EXPECT_EQ(active, contour_.crossings.cells.size());
}

TEST_P(RandomCrossings, EachSegmentEndsWhereTheNextBeginsAndNoTwoShareASuccessor) {
  std::set<std::uint32_t> successors;
  for (std::uint32_t k = 0; k < contour_.crossings.segments.size(); ++k) {
    const std::uint32_t next = NextSegment(contour_.tiles, contour_.crossings, k);
    EXPECT_TRUE(successors.insert(next).second);
    const Segment& here = contour_.crossings.segments[k];
    const Segment& there = contour_.crossings.segments[next];
    const Point exit = EdgeCrossing(contour_.tiles, contour_.level_set,
                                    contour_.crossings.cells[here.cell], here.exit);
    const Point entry = EdgeCrossing(contour_.tiles, contour_.level_set,
                                     contour_.crossings.cells[there.cell], there.entry);
    EXPECT_EQ(exit.x, entry.x);
    EXPECT_EQ(exit.y, entry.y);
  }
}

TEST_P(RandomCrossings, NoCrossingTouchesANode) {
  for (const Segment& segment : contour_.crossings.segments) {
    const Point point = EdgeCrossing(contour_.tiles, contour_.level_set,
                                     contour_.crossings.cells[segment.cell], segment.entry);
    const double off_x = std::abs(point.x - std::round(point.x));
    const double off_y = std::abs(point.y - std::round(point.y));
    EXPECT_EQ(std::min(off_x, off_y), 0);
    EXPECT_GE(std::max(off_x, off_y), 1.0 / 4096);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomCrossings, testing::Range(1, 11));

TEST(Crossings, APatternHasTheSameContourOnEitherSideOfATilesSeam) {
  const auto pattern = RandomField(7, -1, -1, 12, 12);
  using Place = std::tuple<int, int, int, int>;  // Column, row, entry, exit.
  const auto segments_at = [&](int dx, int dy) {
    const Contour contour([&](int x, int y) { return pattern(x - dx, y - dy); }, {-1, -1}, {2, 2});
    std::set<Place> places;
    for (const Segment& segment : contour.crossings.segments) {
      const auto [column, row] = contour.Place(contour.crossings.cells[segment.cell]);
      places.insert({column - dx, row - dy, segment.entry, segment.exit});
    }
    return places;
  };
  const std::set<Place> expected = segments_at(4, 4);
  EXPECT_GT(expected.size(), 100u);
  for (const auto& [dx, dy] : {std::pair(26, 4), std::pair(4, 26), std::pair(26, 26),
                               std::pair(-6, -6), std::pair(31, 32), std::pair(20, 63)}) {
    EXPECT_EQ(segments_at(dx, dy), expected) << "shifted by " << dx << ", " << dy;
  }
}

TEST(Crossings, CellsComeByTileThenRowThenColumn) {
  const Contour contour(RandomField(8, -31, -31, 62, 30), {-1, -1}, {0, 1});
  for (std::size_t k = 1; k < contour.crossings.cells.size(); ++k) {
    const ActiveCell& a = contour.crossings.cells[k - 1];
    const ActiveCell& b = contour.crossings.cells[k];
    EXPECT_LT(std::tuple(a.tile, a.j, a.i), std::tuple(b.tile, b.j, b.i));
  }
}

}  // namespace
}  // namespace partiemc
