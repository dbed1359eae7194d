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

constexpr int kPlacements = 8;

double Equal(Random&, double, double) { return 1; }

// A frame of reference along a wall: a = along it, w = the height above it.
struct WallFrame {
  double x, y, ux, uy;

  explicit WallFrame(Random& random) {
    const double tilt = random.Uniform(0, 2 * std::numbers::pi);
    x = random.Uniform(-3, 3);
    y = random.Uniform(-3, 3);
    ux = std::cos(tilt);
    uy = std::sin(tilt);
  }
  double A(double px, double py) const { return (px - x) * ux + (py - y) * uy; }
  double W(double px, double py) const { return (py - y) * ux - (px - x) * uy; }
  void Add(double a, double w, Particles& to) const {
    to.Add(x + a * ux - w * uy, y + a * uy + w * ux);
  }
  Wall Floor() const { return {{x, y, x + ux, y + uy}}; }
};

struct DropFigures {
  double foot = 0, angle = 0, deviation = 0, area = 0;  // Means of magnitudes.
  double worst_foot = 0;
};

// A drop whose outline is an arc that meets a wall at a known angle, in degrees.
DropFigures MeasureDrops(double degrees, double noise, std::uint64_t seed) {
  DropFigures figures;
  int feet = 0, points = 0;
  const double angle = degrees * std::numbers::pi / 180, radius = degrees < 45 ? 32 : 16;
  const double centre = -radius * std::cos(angle), half = radius * std::sin(angle);
  Random random(seed);
  for (int k = 0; k < kPlacements; ++k) {
    const WallFrame frame(random);
    const Body drop{[&](double x, double y) {
                      const double a = frame.A(x, y), w = frame.W(x, y);
                      return std::max(std::hypot(a, w - centre) - radius, -w);
                    },
                    60};
    Particles particles = Filled(drop, random, Equal);
    particles = Shaken(particles, random, noise);
    const Result result =
        support::ReconstructOnce({.spacing = 1.0, .walls = {frame.Floor()}}, particles);
    EXPECT_TRUE(Validate(result).ok());
    const Rings& rings = result.rings;
    for (std::size_t c = 0; c < rings.contacts.size(); ++c) {
      const std::size_t p = 2 * std::size_t{rings.contacts[c]};
      const double off = std::abs(std::abs(frame.A(rings.points[p], rings.points[p + 1])) - half);
      figures.foot += off;
      figures.worst_foot = std::max(figures.worst_foot, off);
      figures.angle +=
          std::abs(rings.contact_angles[c] * 180 / std::numbers::pi_v<float> - degrees);
      ++feet;
    }
    for (std::size_t p = 0; p < rings.points.size(); p += 2) {
      const double a = frame.A(rings.points[p], rings.points[p + 1]);
      const double w = frame.W(rings.points[p], rings.points[p + 1]);
      if (w < .1) continue;
      figures.deviation += std::abs(std::hypot(a, w - centre) - radius);
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
      const DropFigures figures = MeasureDrops(degrees, noise, 51);
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

}  // namespace
}  // namespace partiemc
