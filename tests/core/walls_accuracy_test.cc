// Feet and angles of drops at walls, walls of particles and their corners. The tests print the
// tables of core/WALLS.md. No constant was fitted to these scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <numbers>

#include "partiemc/partiemc.h"
#include "partiemc/validate.h"
#include "support/reconstruct.h"
#include "support/sized_scenes.h"
#include "support/wall_scenes.h"

namespace partiemc {
namespace {

using support::Body;
using support::Particles;
using support::Random;
using support::WallFrame;

constexpr int kPlacements = 8;

double Equal(Random&, double, double) { return 1; }

// Particles of the sizes 1 and `size`; `share` of them are large.
support::DrawSize OfTwo(double size, double share) {
  return [=](Random& random, double, double) { return random.Chance(share) ? size : 1.0; };
}

// Particles at a wall. `spacing`: the root mean square of their sizes.
struct Fluid {
  const char* name;
  support::DrawSize draw;
  double spacing;
  Sizes sizes = Sizes::kOwn;
};

struct DropFigures {
  double foot = 0, angle = 0, deviation = 0, area = 0;  // Means of magnitudes.
  double worst_foot = 0;                                // Lengths are in spacings.
};

// A drop whose outline is an arc that meets a wall at a known angle, in degrees.
DropFigures MeasureDrops(const Fluid& fluid, double degrees, double noise, std::uint64_t seed) {
  DropFigures figures;
  int feet = 0, points = 0;
  const double h = fluid.spacing;
  const double angle = degrees * std::numbers::pi / 180, radius = (degrees < 45 ? 32 : 16) * h;
  const double centre = -radius * std::cos(angle), half = radius * std::sin(angle);
  Random random(seed);
  for (int k = 0; k < kPlacements; ++k) {
    const WallFrame frame(random);
    const Body drop{[&](double x, double y) {
                      const double a = frame.A(x, y), w = frame.W(x, y);
                      return std::max(std::hypot(a, w - centre) - radius, -w);
                    },
                    60 * h};
    Particles particles = Filled(drop, random, fluid.draw);
    particles = Shaken(particles, random, noise);
    const Result result = support::ReconstructOnce(
        {.spacing = h, .sizes = fluid.sizes, .walls = {frame.Floor()}}, particles);
    EXPECT_TRUE(Validate(result).ok());
    const Rings& rings = result.rings;
    for (std::size_t c = 0; c < rings.contacts.size(); ++c) {
      const std::size_t p = 2 * std::size_t{rings.contacts[c]};
      const double a = frame.A(rings.points[p], rings.points[p + 1]);
      const double off = std::abs(std::abs(a) - half) / h;
      figures.foot += off;
      figures.worst_foot = std::max(figures.worst_foot, off);
      figures.angle +=
          std::abs(rings.contact_angles[c] * 180 / std::numbers::pi_v<float> - degrees);
      ++feet;
    }
    for (std::size_t p = 0; p < rings.points.size(); p += 2) {
      const double a = frame.A(rings.points[p], rings.points[p + 1]);
      const double w = frame.W(rings.points[p], rings.points[p + 1]);
      if (w < .1 * h) continue;
      figures.deviation += std::abs(std::hypot(a, w - centre) - radius) / h;
      ++points;
    }
    const double area = radius * radius * (angle - std::sin(angle) * std::cos(angle));
    figures.area += std::abs(result.statistics.area / area - 1) / kPlacements;
  }
  figures.foot /= feet;
  figures.angle /= feet;
  figures.deviation /= points;
  return figures;
}

TEST(WallsAccuracy, DropsMeetWallsAtTheirAngles) {
  std::printf("%8s %6s %7s %7s %7s %10s %7s\n", "degrees", "noise", "foot", "worst", "angle",
              "deviation", "area");
  for (const double degrees : {30.0, 60.0, 90.0, 120.0, 150.0}) {
    for (const double noise : {0.0, .1}) {
      SCOPED_TRACE(testing::Message() << degrees << " degrees, noise " << noise);
      const DropFigures figures =
          MeasureDrops({"equal", Equal, 1, Sizes::kEqual}, degrees, noise, 51);
      std::printf("%8.0f %6.2f %7.3f %7.3f %7.2f %10.3f %6.2f%%\n", degrees, noise, figures.foot,
                  figures.worst_foot, figures.angle, figures.deviation, 100 * figures.area);
      if (noise > 0) continue;
      if (degrees >= 60 && degrees <= 120) {
        EXPECT_LT(figures.foot, .2);
      }
      if (degrees <= 120) {
        EXPECT_LT(figures.angle, 3);
      }
      EXPECT_LT(figures.deviation, .05);
    }
  }
}

TEST(WallsAccuracy, DropsOfOwnSizesMeetWallsAtTheirAngles) {
  // Large particles on one side, small ones on the other.
  const auto zones = [](Random& random, double x, double) {
    return x > 0 ? 1.0 : random.Chance(.25) ? 2.0 : 0;
  };
  const Fluid fluids[] = {{"equal", Equal, 1},
                          {"1:3", OfTwo(3, .2), std::sqrt(2.6)},
                          {"2:1 zones", zones, std::sqrt(1.6)}};
  std::printf("%10s %8s %6s %7s %7s %7s %10s %7s\n", "sizes", "degrees", "noise", "foot", "worst",
              "angle", "deviation", "area");
  for (const Fluid& fluid : fluids) {
    for (const double degrees : {60.0, 90.0, 120.0}) {
      for (const double noise : {0.0, .1}) {
        const DropFigures figures = MeasureDrops(fluid, degrees, noise, 52);
        std::printf("%10s %8.0f %6.2f %7.3f %7.3f %7.2f %10.3f %6.2f%%\n", fluid.name, degrees,
                    noise, figures.foot, figures.worst_foot, figures.angle, figures.deviation,
                    100 * figures.area);
        EXPECT_LT(figures.area, .02);
        if (noise > 0) continue;
        EXPECT_LT(figures.foot, .3);
        EXPECT_LT(figures.angle, 5);
        EXPECT_LT(figures.deviation, .1);
      }
    }
  }
}

// A rotated tank of particles in layers, with fluid in it.
TEST(WallsAccuracy, TanksOfParticlesHaveStraightWallsAndCorners) {
  constexpr double kWidth = 27.6, kDepth = 13;
  std::printf("%7s %7s %7s %7s %7s\n", "layers", "offset", "rms", "corner", "area");
  for (const int layers : {1, 2, 3}) {
    double offset = 0, square = 0, corner = 0, area = 0;
    int count = 0;
    Random random(61);
    for (int k = 0; k < kPlacements; ++k) {
      const WallFrame frame(random);
      const Body fluid{[&](double x, double y) {
                         const double a = frame.A(x, y), w = frame.W(x, y);
                         return std::max({-a, a - kWidth, -w, w - kDepth});
                       },
                       50};
      Particles particles = Filled(fluid, random, Equal);
      particles.volumes.clear();
      particles.phases.assign(particles.size(), 1);
      for (int layer = 0; layer < layers; ++layer) {
        const double depth = layer + .5;
        for (double a = -depth; a < kWidth + depth + .1; ++a) frame.Add(a, -depth, particles);
        for (double w = 1 - depth; w < kDepth + 6; ++w) {
          frame.Add(-depth, w, particles);
          frame.Add(kWidth + depth, w, particles);
        }
      }
      particles.phases.resize(particles.size(), 2);
      const Result result =
          support::ReconstructOnce({.spacing = 1.0, .wall_phases = {2}}, particles);
      EXPECT_TRUE(Validate(result).ok());
      const Rings& rings = result.rings;
      area += std::abs(result.statistics.area / (kWidth * kDepth) - 1) / kPlacements;
      std::array<double, 2> nearest = {1e300, 1e300};
      for (std::size_t p = 0; p < rings.PointCount(); ++p) {
        const double a = frame.A(rings.points[2 * p], rings.points[2 * p + 1]);
        const double w = frame.W(rings.points[2 * p], rings.points[2 * p + 1]);
        nearest[0] = std::min(nearest[0], std::hypot(a, w));
        nearest[1] = std::min(nearest[1], std::hypot(a - kWidth, w));
        const bool is_wet = std::ranges::binary_search(rings.wetted, p);
        if (!is_wet || (std::min(a, kWidth - a) < 3 && w < 3)) continue;
        const double height = std::min({a, kWidth - a, w});
        offset += height;
        square += height * height;
        ++count;
      }
      corner += (nearest[0] + nearest[1]) / (2 * kPlacements);
    }
    offset /= count;
    const double rms = std::sqrt(square / count - offset * offset);
    std::printf("%7d %7.3f %7.3f %7.3f %6.2f%%\n", layers, offset, rms, corner, 100 * area);
    if (layers == 1) continue;
    EXPECT_LT(std::abs(offset), .05);
    EXPECT_LT(rms, .04);
    EXPECT_LT(corner, .25);
  }
}

// The distance of a point from the nearest vertex.
double DistanceFrom(const Rings& rings, double x, double y) {
  double nearest = 1e300;
  for (std::size_t p = 0; p < rings.points.size(); p += 2) {
    nearest = std::min(nearest, std::hypot(rings.points[p] - x, rings.points[p + 1] - y));
  }
  return nearest;
}

// Rotated full tanks of lines, with two sharp and two obtuse corners.
TEST(WallsAccuracy, FluidFillsTheCornersOfTanks) {
  constexpr double kSide = 26;
  std::printf("%8s %6s %7s\n", "degrees", "noise", "corner");
  for (const double degrees : {30.0, 45.0, 60.0, 75.0, 90.0}) {
    for (const double noise : {0.0, .1}) {
      double farthest = 0;
      Random random(89);
      for (int k = 0; k < kPlacements; ++k) {
        const double angle = degrees * std::numbers::pi / 180, turn = random.Uniform(0, 7);
        const double x = random.Uniform(-3, 3), y = random.Uniform(-3, 3);
        const double ux = kSide * std::cos(turn), uy = kSide * std::sin(turn);
        const double vx = kSide * std::cos(turn + angle), vy = kSide * std::sin(turn + angle);
        const Wall tank{{x, y, x + ux, y + uy, x + ux + vx, y + uy + vy, x + vx, y + vy}};
        const Body fluid{[&](double px, double py) { return -support::HeightAbove(tank, px, py); },
                         60};
        Particles particles = Shaken(Filled(fluid, random, Equal), random, noise);
        particles.volumes.clear();
        const Result result =
            support::ReconstructOnce({.spacing = 1.0, .walls = {tank}}, particles);
        EXPECT_TRUE(Validate(result).ok());
        for (std::size_t corner = 0; corner < tank.points.size(); corner += 2) {
          farthest = std::max(
              farthest, DistanceFrom(result.rings, tank.points[corner], tank.points[corner + 1]));
        }
      }
      std::printf("%8.0f %6.2f %7.4f\n", degrees, noise, farthest);
      EXPECT_LT(farthest, 1e-9);
    }
  }
}

}  // namespace
}  // namespace partiemc
