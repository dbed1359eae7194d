// Curves of interfaces near junctions.
#include "phases/arc_curve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/random.h"

namespace partiemc {
namespace {

// Points of a circle that touches the x axis at the origin, or of that axis, each .5 along it.
ArcCurveFit FitTo(double radius, double noise, support::Random& random) {
  ArcCurveFit fit;
  for (double s = .5; s < 12; s += .5) {
    const double off = random.Uniform(-noise, noise);
    if (std::isinf(radius)) {
      fit.Add({s, off}, s);
    } else {
      const double by = radius - off;
      fit.Add({by * std::sin(s / radius), radius - by * std::cos(s / radius)}, s);
    }
  }
  return fit;
}

TEST(ArcCurve, IsTheCircleOrTheLineOfItsPoints) {
  support::Random random(1);
  for (const double radius : {4., 10., 1e3, HUGE_VAL, -10., -4.}) {
    const auto curve = FitTo(radius, 0, random).Fit(kPlaceNoise);
    ASSERT_TRUE(curve) << radius;
    const Line line = curve->TangentNear({});
    EXPECT_NEAR(line.through.x, 0, 1e-9) << radius;
    EXPECT_NEAR(line.through.y, 0, 1e-9) << radius;
    EXPECT_NEAR(line.along.x, 1, 1e-9) << radius;
    EXPECT_NEAR(line.along.y, 0, 1e-9) << radius;
  }
}

// A tangent beside the curve touches it up to the second order in the distance.
TEST(ArcCurve, TangentsTouchTheCurve) {
  support::Random random(1);
  const double radius = 8;
  const auto curve = FitTo(radius, 0, random).Fit(kPlaceNoise);
  ASSERT_TRUE(curve);
  for (const double off : {-.2, .2}) {
    const Line line = curve->TangentNear({.5, off});
    const double height =
        std::abs(line.along.x * (radius - line.through.y) + line.along.y * line.through.x);
    EXPECT_NEAR(height, radius, .01);
  }
  // The middle of the circle has no nearest point.
  const Line line = curve->TangentNear({0, radius});
  EXPECT_NEAR(std::hypot(line.along.x, line.along.y), 1, 1e-12);
  EXPECT_TRUE(std::isfinite(line.through.x) && std::isfinite(line.through.y));
}

TEST(ArcCurve, NoiseDoesNotBendLines) {
  int bent = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    support::Random random(seed);
    const auto curve = FitTo(HUGE_VAL, .1, random).Fit(kPlaceNoise);
    ASSERT_TRUE(curve);
    bent += curve->bend != 0;
  }
  EXPECT_EQ(bent, 0);
}

TEST(ArcCurve, NeedsTwoPoints) {
  ArcCurveFit fit;
  fit.Add({1, 0}, 1);
  fit.Add({2, 0}, 2);
  fit.Add({6, 0}, 6);
  EXPECT_FALSE(fit.Fit(kPlaceNoise));
  fit.Add({2, 0}, 3);
  EXPECT_FALSE(fit.Fit(kPlaceNoise));  // At one place.
  fit.Add({3, 0}, 4);
  const auto curve = fit.Fit(kPlaceNoise);
  ASSERT_TRUE(curve);
  EXPECT_EQ(curve->bend, 0);
}

}  // namespace
}  // namespace partiemc
