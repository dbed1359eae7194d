// Cuts random loops at lines, and measures their parts in windows.
#include "cut/line_cut.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "rings/percolation.h"
#include "support/random.h"
#include "support/tries.h"
#include "vertices/measure.h"

namespace partiemc {
namespace {

using support::Random;

// ------------------------------------------------------------------------------------

// A star around a point, with a hole.
Loops Star(Random& random) {
  Loops loops;
  const double x = random.Uniform(-3, 3), y = random.Uniform(-3, 3);
  const int count = 5 + static_cast<int>(random.Below(40));
  const auto add = [&](double inner, double outer, bool is_hole) {
    const auto first = static_cast<std::uint32_t>(loops.points.size());
    for (int k = 0; k < count; ++k) {
      const double turn = 2 * M_PI * (is_hole ? count - k : k) / count;
      const double radius = random.Uniform(inner, outer);
      loops.points.push_back({.at = {x + radius * std::cos(turn), y + radius * std::sin(turn)}});
    }
    loops.loops.push_back({.first = first,
                           .last = static_cast<std::uint32_t>(loops.points.size()),
                           .ring = is_hole ? 1u : 0u,
                           .outer = 0});
  };
  add(4, 9, false);
  add(1, 2, true);
  return loops;
}

double AreaOf(const Loops& loops) {
  double area = 0;
  for (const Loops::Loop& loop : loops.loops) {
    std::vector<double> points;
    for (std::uint32_t k = loop.first; k < loop.last; ++k) {
      points.insert(points.end(), {loops.points[k].at.x, loops.points[k].at.y});
    }
    area += MeasureRing(points).area;
  }
  return area;
}

TEST(CutAtLine, BothSidesMakeTheWhole) {
  LineCutScratch scratch;
  for (std::uint64_t seed = 1; seed <= support::Tries(2000u); ++seed) {
    Random random(seed);
    const Loops star = Star(random);
    AxisLine line{.axis = static_cast<int>(random.Below(2)), .at = random.Uniform(-10, 10)};
    Loops above, below;
    ASSERT_TRUE(CutAtLine(line, star, scratch, above));
    line.keeps_above = false;
    ASSERT_TRUE(CutAtLine(line, star, scratch, below));
    EXPECT_NEAR(AreaOf(above) + AreaOf(below), AreaOf(star), 1e-11) << seed;
    for (const Loops* part : {&above, &below}) {
      for (const Loops::Loop& loop : part->loops) {
        std::size_t cuts = 0;
        for (std::uint32_t k = loop.first; k < loop.last; ++k) {
          const Point& at = part->points[k].at;
          const double across = line.axis == 0 ? at.x : at.y;
          EXPECT_TRUE(part == &above ? across >= line.at : across <= line.at);
          cuts += part->points[k].is_cut ? 1 : 0;
        }
        EXPECT_EQ(cuts > 0, loop.ring == kNoSource);
      }
    }
  }
}

TEST(CutAtLine, PartInTheWindowHasItsMeasures) {
  LineCutScratch scratch;
  for (std::uint64_t seed = 1; seed <= support::Tries(1000u); ++seed) {
    Random random(seed);
    Loops loops = Star(random);
    Window window;
    if (random.Below(4) > 0) window.axes[0] = PeriodicAxis{random.Uniform(-8, 0), 5};
    if (random.Below(4) > 0) window.axes[1] = PeriodicAxis{random.Uniform(-8, 0), 7};
    double area = 0, perimeter = 0;
    for (const Loops::Loop& loop : loops.loops) {
      std::vector<double> points;
      for (std::uint32_t k = loop.first; k < loop.last; ++k) {
        points.insert(points.end(), {loops.points[k].at.x, loops.points[k].at.y});
      }
      const WindowMeasures part = MeasureInWindow(points, window);
      area += part.area;
      perimeter += part.perimeter;
    }
    for (int axis = 0; axis < 2; ++axis) {
      const auto& ends = window.axes[static_cast<std::size_t>(axis)];
      if (!ends) continue;
      for (const bool above : {true, false}) {
        Loops kept;
        ASSERT_TRUE(CutAtLine({axis, ends->origin + (above ? 0 : ends->length), above}, loops,
                              scratch, kept));
        loops = kept;
      }
    }
    EXPECT_NEAR(area, AreaOf(loops), 1e-11) << seed;
    double length = 0;
    for (const Loops::Loop& loop : loops.loops) {
      for (std::uint32_t k = loop.first; k < loop.last; ++k) {
        if (loops.points[k].is_cut) continue;
        const Point& from = loops.points[k].at;
        const Point& to = loops.points[k + 1 < loop.last ? k + 1 : loop.first].at;
        length += std::hypot(to.x - from.x, to.y - from.y);
      }
    }
    EXPECT_NEAR(perimeter, length, 1e-10) << seed;
  }
}

TEST(CutAtLine, PointOnTheLineIsReported) {
  Loops square;
  for (const auto& [x, y] : {std::pair(0., 0.), {2., 0.}, {2., 2.}, {0., 2.}}) {
    square.points.push_back({.at = {x, y}});
  }
  square.loops.push_back({.first = 0, .last = 4, .ring = 0, .outer = 0});
  LineCutScratch scratch;
  Loops kept;
  EXPECT_FALSE(CutAtLine({.axis = 0, .at = 2}, square, scratch, kept));
  kept.Clear();
  EXPECT_TRUE(CutAtLine({.axis = 0, .at = 1}, square, scratch, kept));
  EXPECT_EQ(AreaOf(kept), 2);
}

}  // namespace
}  // namespace partiemc
