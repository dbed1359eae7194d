// Outlines, erosion, nearest segments, and the numbers underneath.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "client/evaluation/scenes/erosion.h"
#include "client/evaluation/scenes/outline.h"
#include "client/evaluation/scenes/random.h"
#include "client/evaluation/scenes/segment_index.h"
#include "client/evaluation/scenes/shapes.h"
#include "client/evaluation/scenes/trigonometry.h"

namespace partiemc::evaluation {
namespace {

Outline Disc(Point center, double radius) {
  Outline outline;
  outline.AddLoop(EllipseLoop(center, radius, radius, 0));
  return outline;
}

double BruteForceDistance(const Outline& outline, Point p) {
  double least = 1e300;
  for (std::size_t k = 0; k < outline.LoopCount(); ++k) {
    const auto loop = outline.Loop(k);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point a = loop[i];
      const Point along = loop[(i + 1) % loop.size()] - a;
      const double t = std::fmin(1, std::fmax(0, Dot(p - a, along) / Dot(along, along)));
      least = std::fmin(least, Length(p - (a + t * along)));
    }
  }
  return least;
}

TEST(Random, GivesTheNumbersOfItsReferenceImplementation) {
  // The first outputs of xoshiro256** with a state of four outputs of splitmix64 from 0.
  Random random(0);
  EXPECT_EQ(random.Next(), 0x99ec5f36cb75f2b4u);
  EXPECT_EQ(random.Next(), 0xbf6e1f784956452au);
}

TEST(Random, NormalNumbersHaveMeanZeroAndDeviationOne) {
  Random random(7);
  double sum = 0, squares = 0;
  constexpr int kCount = 20000;
  for (int k = 0; k < kCount; ++k) {
    const double value = random.Normal();
    sum += value;
    squares += value * value;
  }
  EXPECT_NEAR(sum / kCount, 0, 0.03);
  EXPECT_NEAR(squares / kCount, 1, 0.04);
}

TEST(Trigonometry, AgreesWithTheStandardLibraryForAnglesOfEverySize) {
  for (double angle = -9000; angle < 9000; angle += 3.7) {
    const Direction d = DirectionOf(angle);
    EXPECT_NEAR(d.cosine, std::cos(angle), 1e-12) << angle;
    EXPECT_NEAR(d.sine, std::sin(angle), 1e-12) << angle;
  }
  EXPECT_NEAR(DirectionOf(0.3).sine, std::sin(0.3), 1e-15);
}

TEST(Shapes, HaveTheAreasThatFormulasSay) {
  EXPECT_NEAR(SignedArea(MakeShape("disc", 1000, 0.25)), 1000, 1e-3);
  EXPECT_NEAR(SignedArea(MakeShape("annulus", 1000, 0.25)), 1000, 1e-3);
  EXPECT_NEAR(SignedArea(MakeShape("two-discs", 1000, 0.25)), 1000, 2e-3);
  EXPECT_NEAR(SignedArea(MakeShape("horseshoe", 1000, 0.25)), 1000, 1e-3);
  EXPECT_NEAR(SignedArea(MakeShape("ellipse", 1000, 0.25)), 1000, 2e-3);
  EXPECT_NEAR(SignedArea(MakeShape("two-ellipses", 1000, 0.25)), 1000, 2e-3);
  EXPECT_NEAR(SignedArea(MakeShape("lens", 1000, 0.25)), 1000, 2e-3);
  EXPECT_NEAR(SignedArea(MakeShape("clover", 1000, 0.25)), 1000, 1e-2);
  EXPECT_NEAR(SignedArea(MakeShape("blob-with-holes", 1000, 0.25)), 1000, 1e-2);
  EXPECT_NEAR(SignedArea(MakeShape("gear", 1000, 0.25)), 1000, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("star", 1000, 0.25)), 1000, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("triangle", 1000, 0.25)), 1000, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("square", 1024, 0.25)), 1024, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("ell", 1200, 0.25)), 1200, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("bar", 600, 0.25)), 600, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("rectangle", 968, 0.25)), 968, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("cross", 1125, 0.25)), 1125, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("frame", 21 * 64, 0.25)), 21 * 64, 1e-8);
  EXPECT_NEAR(SignedArea(MakeShape("comb", 14 * 64, 0.25)), 14 * 64, 1e-8);
}

TEST(Shapes, OfTuningAndValidationAreDifferentAndSimple) {
  std::vector<std::string_view> all;
  for (const auto shapes : {TuningShapes(), ValidationShapes()}) {
    for (const std::string_view shape : shapes) {
      EXPECT_EQ(std::count(all.begin(), all.end(), shape), 0) << shape;
      all.push_back(shape);
      const Outline outline = MakeShape(shape, 900, 0.25);
      EXPECT_EQ(SegmentIndex(outline, 0.5).CountCrossings(), 0u) << shape;
      EXPECT_GT(SignedArea(outline), 0) << shape;
    }
  }
}

TEST(SegmentIndex, FindsWhatAllSegmentsTogetherSay) {
  Random random(11);
  for (const std::string_view shape : {"star", "blob-with-holes", "two-discs"}) {
    const Outline outline = MakeShape(shape, 600, 0.25);
    for (const double cell : {0.05, 0.5, 20.0}) {
      const SegmentIndex index(outline, cell);
      for (int k = 0; k < 200; ++k) {
        const double reach = k % 10 == 0 ? 500 : 25;
        const double x = random.Uniform(-reach, reach);
        const Point p = {x, random.Uniform(-reach, reach)};
        EXPECT_NEAR(index.Find(p).distance, BruteForceDistance(outline, p), 1e-12)
            << shape << " seed 11 at " << p.x << ", " << p.y;
      }
    }
  }
}

TEST(SegmentIndex, KnowsInsideFromOutsideInHolesAndGaps) {
  const SegmentIndex annulus(MakeShape("annulus", 1000, 0.25), 0.5);
  EXPECT_FALSE(annulus.Contains({0, 0}));
  EXPECT_TRUE(annulus.Contains({15, 0}));
  EXPECT_FALSE(annulus.Contains({100, 0}));
  EXPECT_LT(annulus.SignedDistance({0, 0}), 0);
  EXPECT_GT(annulus.SignedDistance({15, 0}), 0);
}

TEST(SegmentIndex, CountsTheCrossingsOfAFigureOfEight) {
  Outline outline;
  outline.AddLoop(std::vector<Point>{{0, 0}, {2, 2}, {2, 0}, {0, 2}});
  EXPECT_EQ(SegmentIndex(outline, 0.3).CountCrossings(), 1u);
}

TEST(Erosion, OfADiscIsASmallerDisc) {
  const Outline eroded = ErodedOutline(Disc({3, 4}, 10), 0.5);
  ASSERT_EQ(eroded.LoopCount(), 1u);
  for (const Point& p : eroded.points) EXPECT_NEAR(Length(p - Point{3, 4}), 9.5, 1e-3);
}

TEST(Erosion, KeepsConvexCornersSharp) {
  const Outline eroded = ErodedOutline(MakeShape("square", 400, 0.25), 0.5);
  ASSERT_EQ(eroded.LoopCount(), 1u);
  EXPECT_NEAR(SignedArea(eroded), 19 * 19, 1e-6);
}

TEST(Erosion, RoundsReentrantCorners) {
  // The box of 2u eroded, without the box of u that the notch takes from it; its corner is an arc.
  const double u = 20, d = 0.5;
  const double exact =
      (2 * u - 2 * d) * (2 * u - 2 * d) - u * u + d * d - std::numbers::pi * d * d / 4;
  EXPECT_NEAR(SignedArea(ErodedOutline(MakeShape("ell", 3 * u * u, 0.25), d)), exact, 1e-3);
}

TEST(Erosion, WidensHoles) {
  const Outline region = MakeShape("annulus", 1000, 0.25);
  const Outline eroded = ErodedOutline(region, 0.5);
  ASSERT_EQ(eroded.LoopCount(), 2u);
  EXPECT_LT(Length(eroded.Loop(0)[0]), Length(region.Loop(0)[0]));
  EXPECT_GT(Length(eroded.Loop(1)[0]), Length(region.Loop(1)[0]));
}

TEST(Erosion, IsEmptyWhereTheRegionIsThinnerThanTwiceTheDepth) {
  EXPECT_TRUE(ErodedOutline(MakeShape("bar", 600, 0.25), 3.5).Empty());
}

}  // namespace
}  // namespace partiemc::evaluation
