#include "mesh/loop_strip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "region_cover.h"
#include "region_shapes.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::ExpectCover;
using support::RandomEngine;
using support::Rectangle;
using support::Region;
using support::Reversed;
using support::Uniform;

std::optional<std::vector<std::uint32_t>> Strip(const Region& region, LoopStrip& strip) {
  EXPECT_EQ(region.LoopCount(), 2u);
  const auto loop = [&](std::size_t k) {
    return std::span(region.loop_points)
        .subspan(region.loop_offsets[k], region.loop_offsets[k + 1] - region.loop_offsets[k]);
  };
  std::vector<std::uint32_t> triangles{7, 8, 9};
  if (!strip.Triangulate(region.points, loop(0), loop(1), triangles)) {
    EXPECT_EQ(triangles, (std::vector<std::uint32_t>{7, 8, 9}));
    return std::nullopt;
  }
  EXPECT_EQ(triangles.size(), 3 + 3 * region.loop_points.size());
  triangles.erase(triangles.begin(), triangles.begin() + 3);
  return triangles;
}

std::optional<std::vector<std::uint32_t>> Strip(const Region& region) {
  LoopStrip strip;
  return Strip(region, strip);
}

void ExpectStrip(const Region& region) {
  const auto triangles = Strip(region);
  ASSERT_TRUE(triangles.has_value());
  ExpectCover(region, *triangles);
}

Region RegionBetween(const std::vector<Point>& loop, const std::vector<Point>& other) {
  return support::RegionOf({loop, other});
}

/// A loop around the origin with a wavy random radius.
std::vector<Point> Wobbly(RandomEngine& random, double radius, std::size_t count) {
  constexpr double kTurn = 6.283185307179586;
  const double depth = Uniform(random, 0, 0.1);
  const double waves = std::floor(Uniform(random, 2, 9));
  std::vector<Point> loop;
  for (std::size_t k = 0; k < count; ++k) {
    const double angle = kTurn * static_cast<double>(k) / static_cast<double>(count);
    const double distance =
        radius * (1 + depth * std::sin(waves * angle) + Uniform(random, 0, .01));
    loop.push_back({distance * std::cos(angle), distance * std::sin(angle)});
  }
  return loop;
}

TEST(LoopStrip, FrameHasOneTriangleForEachPoint) {
  ExpectStrip(RegionBetween(Rectangle(0, 0, 4, 4), Reversed(Rectangle(1, 1, 3, 3))));
  ExpectStrip(RegionBetween(Reversed(Rectangle(1, 1, 3, 3)), Rectangle(0, 0, 4, 4)));
}

TEST(LoopStrip, ManyPointsOnOneSideAndFewOnTheOther) {
  RandomEngine random(3);
  std::vector<Point> fine;
  for (int k = 0; k < 40; ++k) fine.push_back({0.1 * k, 0});
  for (int k = 0; k < 40; ++k) fine.push_back({4, 0.1 * k});
  for (int k = 40; k > 0; --k) fine.push_back({0.1 * k, 4});
  for (int k = 40; k > 0; --k) fine.push_back({0, 0.1 * k});
  ExpectStrip(RegionBetween(fine, Reversed(Rectangle(1, 1, 3, 3))));
  ExpectStrip(RegionBetween(Wobbly(random, 10, 300), Reversed(Rectangle(-1, -1, 1, 1))));
}

TEST(LoopStrip, WobblyRingsAreCoveredAtAnyScaleAndPlace) {
  RandomEngine random(4);
  for (int round = 0; round < support::Tries(100); ++round) {
    SCOPED_TRACE("seed 4, round " + std::to_string(round));
    const auto count = [&] { return static_cast<std::size_t>(Uniform(random, 30, 200)); };
    const Region region =
        RegionBetween(Wobbly(random, 10, count()), Reversed(Wobbly(random, 7, count())));
    ExpectStrip(region);
    ExpectStrip(region.Transformed(1e-30, 0));
    ExpectStrip(region.Transformed(1e30, 0));
    ExpectStrip(region.Transformed(0.01, 1e4));
  }
}

TEST(LoopStrip, TouchingRingIsCoveredOrRefused) {
  Region region;
  region.AddLoop(Rectangle(0, 0, 4, 4));
  region.AddLoop({0, region.AddPoint({1, 3}), region.AddPoint({3, 3}), region.AddPoint({3, 1})});
  if (const auto triangles = Strip(region)) ExpectCover(region, *triangles);
}

TEST(LoopStrip, AcceptedBandsAreCovered) {
  std::size_t strips = 0, bands = 0;
  for (std::uint64_t seed = 0; seed < support::Tries(600u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomEngine random(seed);
    const Region band = support::RandomBand(random, 8 + seed % 12);
    if (band.LoopCount() != 2) continue;
    ++bands;
    if (const auto triangles = Strip(band)) {
      ++strips;
      ExpectCover(band, *triangles);
    }
  }
  EXPECT_GT(bands, 20u);
  EXPECT_GT(strips, bands / 2);
}

// For any loops, accepted triangles are counter-clockwise, and their sides sum to the loops.
TEST(LoopStrip, AcceptedRandomLoopsKeepTheirSides) {
  RandomEngine random(5);
  LoopStrip strip;
  std::size_t taken = 0;
  for (int round = 0; round < 200'000; ++round) {
    const Region region = support::RandomGarbage(random, 3 + round % 3, 2, 3 + round % 6);
    if (region.LoopCount() != 2) continue;
    const auto triangles = Strip(region, strip);
    if (!triangles.has_value()) continue;
    ++taken;
    ExpectCover(region, *triangles);
    ASSERT_FALSE(HasFailure()) << "seed 5, round " << round;
  }
  EXPECT_GT(taken, 0u);
}

TEST(LoopStrip, RingWithOnePointMovedIsCoveredOrRefused) {
  RandomEngine random(9);
  std::size_t taken = 0;
  for (int round = 0; round < support::Tries(2'000); ++round) {
    SCOPED_TRACE("seed 9, round " + std::to_string(round));
    Region region = RegionBetween(Wobbly(random, 10, 30), Reversed(Wobbly(random, 7, 25)));
    region.points[random() % region.points.size()] += Uniform(random, -6, 6);
    if (const auto triangles = Strip(region)) {
      ++taken;
      ExpectCover(region, *triangles);
    }
  }
  EXPECT_GT(taken, support::Tries(500u));
  EXPECT_LT(taken, 2'000u);
}

TEST(LoopStrip, RefusesOtherRegions) {
  const auto square = Rectangle(0, 0, 4, 4);
  EXPECT_FALSE(Strip(RegionBetween(square, Rectangle(1, 1, 3, 3)))) << "the same way round";
  EXPECT_FALSE(Strip(RegionBetween(Rectangle(1, 1, 3, 3), square))) << "the same way round";
  EXPECT_FALSE(Strip(RegionBetween(square, Reversed(Rectangle(-1, -1, 5, 5))))) << "inside out";
  EXPECT_FALSE(Strip(RegionBetween(square, Reversed(square)))) << "no region between them";
  EXPECT_FALSE(Strip(RegionBetween(square, Rectangle(9, 9, 10, 10)))) << "beside each other";
  const std::vector<Point> coil{{0, 0}, {5, 0}, {5, 5}, {0, 5}, {-1, -1}, {6, -1}, {6, 6}, {-1, 6}};
  EXPECT_FALSE(Strip(RegionBetween(coil, Reversed(Rectangle(2, 2, 3, 3))))) << "turns twice";
  EXPECT_FALSE(Strip(RegionBetween(Rectangle(-9, -9, 9, 9), Reversed(coil)))) << "turns twice";
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(), 1e200, 1e-200}) {
    EXPECT_FALSE(Strip(RegionBetween(square, {{1, 1}, {1, 3}, {3, bad}}))) << bad;
    EXPECT_FALSE(Strip(RegionBetween({{0, 0}, {4, bad}, {4, 4}}, {{1, 1}, {1, 3}, {3, 3}}))) << bad;
  }
}

TEST(LoopStrip, EarlierInputHasNoEffect) {
  RandomEngine random(6);
  LoopStrip warm;
  for (int round = 0; round < 20; ++round) {
    const Region region =
        RegionBetween(Wobbly(random, 10, 20 + random() % 200), Reversed(Wobbly(random, 7, 100)));
    EXPECT_EQ(Strip(region, warm), Strip(region)) << "seed 6, round " << round;
  }
}

}  // namespace
}  // namespace partiemc
