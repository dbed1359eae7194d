#include "region_cover.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

#include "base/predicates.h"

namespace partiemc::support {

void ExpectCover(const Region& region, const std::vector<std::uint32_t>& triangles) {
  using PointKey = std::pair<double, double>;
  std::map<std::pair<PointKey, PointKey>, int> balance;
  const auto add = [&](const Point& a, const Point& b) {
    const PointKey from(a.x, a.y), to(b.x, b.y);
    if (from < to) {
      ++balance[{from, to}];
    } else {
      --balance[{to, from}];
    }
  };
  ASSERT_EQ(triangles.size() % 3, 0u);
  double area = 0;
  for (std::size_t i = 0; i < triangles.size(); i += 3) {
    const Point a = region.PointAt(triangles[i]);
    const Point b = region.PointAt(triangles[i + 1]);
    const Point c = region.PointAt(triangles[i + 2]);
    ASSERT_EQ(Orientation(a, b, c), 1) << "triangle " << i / 3;
    area += DoubleArea({a, b, c});
    add(a, b), add(b, c), add(c, a);
  }
  for (std::size_t k = 0; k < region.LoopCount(); ++k) {
    const std::vector<Point> loop = region.Loop(k);
    for (std::size_t i = 0; i < loop.size(); ++i) add(loop[(i + 1) % loop.size()], loop[i]);
  }
  const auto uneven = std::find_if(balance.begin(), balance.end(),
                                   [](const auto& side) { return side.second != 0; });
  ASSERT_EQ(uneven, balance.end())
      << "gap or overlap at " << uneven->first.first.first << ", " << uneven->first.first.second;
  const double expected = DoubleArea(region);
  EXPECT_NEAR(area, expected, 1e-9 * expected);
}

}  // namespace partiemc::support
