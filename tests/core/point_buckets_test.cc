#include "point_buckets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "support/random.h"

namespace partiemc {
namespace {

struct Thing {
  Point at;
  int name = 0;
};

// All that are visited, each to be visited once.
std::set<int> Visited(const PointBuckets<Thing>& buckets, Point p) {
  std::set<int> names;
  buckets.ForEachNear(p, [&](const Thing& thing) {
    EXPECT_TRUE(names.insert(thing.name).second) << "visited twice";
  });
  return names;
}

// Everything within a cell's width, but for a rounding of the border, is visited.
void ExpectAllNear(const PointBuckets<Thing>& buckets, const std::vector<Thing>& things,
                   double cell, Point p) {
  const std::set<int> visited = Visited(buckets, p);
  const double largest = std::max(std::abs(p.x), std::abs(p.y));
  const double width = cell - 0x1p-50 * (largest + cell);
  for (const Thing& thing : things) {
    if (std::abs(thing.at.x - p.x) > width || std::abs(thing.at.y - p.y) > width) continue;
    EXPECT_TRUE(visited.contains(thing.name))
        << thing.at.x << ", " << thing.at.y << " from " << p.x << ", " << p.y;
  }
}

TEST(PointBuckets, OfNothingVisitNothing) {
  PointBuckets<Thing> buckets;
  buckets.Build({}, 2.5);
  for (const Point p : {Point{0, 0}, Point{-1e9, 1e9}}) EXPECT_TRUE(Visited(buckets, p).empty());
}

TEST(PointBuckets, VisitOnceWhateverIsNear) {
  support::Random random(1);
  PointBuckets<Thing> buckets;
  for (const double cell : {1e-9, 0.3, 1.0, 7.5}) {
    for (const double far : {0.0, -1000.0, 0x1p31}) {
      for (const std::size_t count : {1, 2, 3, 100, 1000}) {
        // From many to a cell to a few.
        const double extent = cell * random.Uniform(0.1, 30);
        const auto place = [&] {
          return Point{far + random.Uniform(-extent, extent), random.Uniform(-extent, extent)};
        };
        std::vector<Thing> things;
        while (things.size() < count) things.push_back({place(), static_cast<int>(things.size())});
        buckets.Build(things, cell);
        for (int k = 0; k < 30; ++k) ExpectAllNear(buckets, things, cell, place());
        for (int k = 0; k < 10; ++k) {
          ExpectAllNear(buckets, things, cell, things[random.Below(count)].at);
        }
      }
    }
  }
}

TEST(PointBuckets, HoldForPlacesOnTheBordersOfCellsAndAroundTheOrigin) {
  std::vector<Thing> things;
  for (int j = -4; j <= 4; ++j) {
    for (int i = -4; i <= 4; ++i) things.push_back({{0.5 * i, 0.5 * j}, 9 * j + i});
  }
  PointBuckets<Thing> buckets;
  buckets.Build(things, 1);
  for (const Thing& thing : things) {
    ExpectAllNear(buckets, things, 1, thing.at);
    EXPECT_TRUE(Visited(buckets, thing.at).contains(thing.name));
  }
}

TEST(PointBuckets, HoldForTheLargestCoordinatesThatTheyTake) {
  std::vector<Thing> things;
  constexpr double kSigns[] = {-1, 0, 1};
  for (const double x : kSigns) {
    for (const double y : kSigns) {
      things.push_back({{0x1p60 * x, 0x1p60 * y}, static_cast<int>(things.size())});
    }
  }
  PointBuckets<Thing> buckets;
  buckets.Build(things, 1);
  for (const Thing& thing : things) EXPECT_TRUE(Visited(buckets, thing.at).contains(thing.name));
}

TEST(PointBuckets, HoldAnyNumberAtOnePlace) {
  std::vector<Thing> things;
  for (int k = 0; k < 5000; ++k) things.push_back({{-7.25, 3}, k});
  PointBuckets<Thing> buckets;
  buckets.Build(things, 2);
  EXPECT_EQ(Visited(buckets, {-6, 4}).size(), things.size());
  EXPECT_EQ(Visited(buckets, {-7.25, 3}).size(), things.size());
}

TEST(PointBuckets, VisitNoMoreOfACrowdThanIsAskedFor) {
  std::vector<Thing> things;
  for (int k = 0; k < 500; ++k) things.push_back({{0.5, 0.5}, k});
  PointBuckets<Thing> buckets;
  buckets.Build(things, 1);
  std::vector<int> names;
  buckets.ForEachNear(
      {0, 0}, [&](const Thing& thing) { names.push_back(thing.name); }, 3);
  EXPECT_EQ(names, (std::vector{0, 1, 2}));
}

TEST(PointBuckets, KeepNothingOfWhatWasBuiltBefore) {
  PointBuckets<Thing> buckets, fresh;
  const std::vector<Thing> many(1000, {{0.5, 0.5}, 3});
  const std::vector<Thing> few = {{{0.5, 0.5}, 1}, {{40, 0.5}, 2}};
  buckets.Build(many, 1);
  buckets.Build(few, 3);
  fresh.Build(few, 3);
  for (const Point p : {Point{0, 0}, Point{41, 1}, Point{20, 20}}) {
    EXPECT_EQ(Visited(buckets, p), Visited(fresh, p));
  }
}

TEST(PointBuckets, SpreadALatticeOverTheirBuckets) {
  // As many as lie in the nine cells, and not many more.
  std::vector<Thing> things;
  for (int j = 0; j < 300; ++j) {
    for (int i = 0; i < 300; ++i) things.push_back({{i + 0.5, j + 0.5}, 300 * j + i});
  }
  PointBuckets<Thing> buckets;
  buckets.Build(things, 3);
  double visited = 0;
  for (int k = 0; k < 100; ++k) {
    visited += static_cast<double>(Visited(buckets, {3.0 * k + 1, 150}).size()) / 100;
  }
  EXPECT_LT(visited, 2 * 81);
}

}  // namespace
}  // namespace partiemc
