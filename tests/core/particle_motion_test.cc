#include "particle_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "support/random.h"

namespace partiemc {
namespace {

// In cells.
constexpr double kReach = 3;

// An affine map about a middle.
struct Map {
  Point middle, shift;
  double xx = 1, xy = 0, yx = 0, yy = 1;

  static Map Turn(double angle, Point middle, Point shift = {}) {
    return {middle, shift, std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle)};
  }
  Point Way(Point p) const {
    const double x = p.x - middle.x, y = p.y - middle.y;
    return {shift.x + (xx - 1) * x + xy * y, shift.y + yx * x + (yy - 1) * y};
  }
  Point Of(Point p) const { return {p.x + Way(p).x, p.y + Way(p).y}; }
};

// Particles of spacing 1 below y = 0.3 around (x, 0), as they lie at an outline, moved by `map`.
std::vector<Mover> Bank(Point middle, const Map& map, double noise = 0, std::uint64_t seed = 1) {
  support::Random random(seed);
  std::vector<Mover> movers;
  for (int j = -6; j <= 0; ++j) {
    for (int i = -6; i <= 6; ++i) {
      const Point at{middle.x + i + random.Uniform(-0.2, 0.2),
                     middle.y + j + random.Uniform(-0.2, 0.2)};
      const Point way = map.Way(at);
      movers.push_back(
          {at, {way.x + random.Uniform(-noise, noise), way.y + random.Uniform(-noise, noise)}});
    }
  }
  return movers;
}

std::optional<Point> Carried(const std::vector<Mover>& movers, Point p, double reach = kReach) {
  ParticleMotion motion;
  motion.Build(movers, reach);
  return motion.Carry(p);
}

double Distance(Point a, Point b) { return std::hypot(a.x - b.x, a.y - b.y); }

// How far from where `map` takes it a point just outside of the bank is carried.
double ErrorOf(const Map& map, double noise = 0, std::uint64_t seed = 1) {
  const Point p{0.1, 0.5};
  return Distance(*Carried(Bank({}, map, noise, seed), p), map.Of(p));
}

TEST(ParticleMotion, WithoutAMoverInReachAPointGoesNowhere) {
  EXPECT_FALSE(Carried({}, {}).has_value());
  for (const double distance : {kReach, kReach + 1e-9, 2 * kReach, 1e6}) {
    EXPECT_FALSE(Carried({{{distance, 0}, {1, 1}}}, {}).has_value()) << distance;
  }
  EXPECT_TRUE(Carried({{{kReach - 1e-9, 0}, {1, 1}}}, {}).has_value());
}

TEST(ParticleMotion, ALoneMoverTakesAPointAlong) {
  for (const Point at : {Point{0, 0}, Point{1, -2}, Point{-2.99, 0}}) {
    EXPECT_EQ(*Carried({{at, {5, -7}}}, {0.25, 0.5}, 4), (Point{5.25, -6.5}));
  }
}

TEST(ParticleMotion, WhatAllMoversDoIsCarriedWithoutALossOfDigits) {
  for (const Point way : {Point{0, 0}, Point{0.1, -0.3}, Point{30, 1e9}}) {
    const Map map{.shift = way};
    EXPECT_EQ(*Carried(Bank({}, map), {0.1, 0.5}), (Point{0.1 + way.x, 0.5 + way.y}));
  }
}

TEST(ParticleMotion, ARigidBodyIsCarriedByAnyTurnToWithinTheRidge) {
  for (int degrees = -180; degrees <= 180; degrees += 5) {
    const Map turn = Map::Turn(degrees * std::numbers::pi / 180, {3, -40}, {30, 8});
    const double size = std::abs(degrees);
    EXPECT_LT(ErrorOf(turn), size <= 10 ? 0.001 : size <= 45 ? 0.01 : 0.15) << degrees;
  }
}

TEST(ParticleMotion, AStrainIsFollowedForMostOfItsWay) {
  const Point p{0.1, 0.5};
  for (const Map& strain : {Map{.xx = 1.05, .yy = 0.95}, Map{.xx = 0.9, .yy = 1.1}, Map{.xy = 0.08},
                            Map{.yx = -0.08}}) {
    const Map map{{0.4, -1.5}, {0.2, 0.1}, strain.xx, strain.xy, strain.yx, strain.yy};
    // Without slopes a point goes as the movers in the middle of those that it hears of do.
    EXPECT_LT(ErrorOf(map), 0.2 * Distance(map.Way(p), map.shift));
  }
}

TEST(ParticleMotion, NoiseIsAveragedAndTakesTheStrainsTrust) {
  double rest_by_noise[3] = {};
  const double noises[3] = {0, 0.1, 0.4};
  double square = 0;
  constexpr int kTrials = 200;
  for (int k = 0; k < 3; ++k) {
    for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
      const Point p{0.1, 0.5};
      const double noise = noises[k];
      // The mean over many noises: what of a strain is left out.
      const Map strain{.yy = 1.2};
      rest_by_noise[k] += (Carried(Bank({}, strain, noise, seed), p)->y - strain.Of(p).y) / kTrials;
      if (k == 1) square += std::pow(ErrorOf({}, noise, seed), 2) / kTrials;
    }
  }
  EXPECT_LT(std::abs(rest_by_noise[0]), std::abs(rest_by_noise[2]) / 2);
  EXPECT_LT(std::abs(rest_by_noise[1]), std::abs(rest_by_noise[2]));
  // Noise of one mover: 0.1 * sqrt(2 / 3) = 0.08, along both axes together.
  EXPECT_LT(std::sqrt(square), 0.05);
}

TEST(ParticleMotion, TwoMoversOrARowOfThemTurnWhatIsBesideThem) {
  for (const int count : {2, 3, 7}) {
    for (const double direction : {0.0, 0.7, std::numbers::pi / 2}) {
      for (const double angle : {-0.3, -0.1, 0.0, 0.2}) {
        const Map map = Map::Turn(angle, {-1, 2}, {3, 4});
        std::vector<Mover> movers;
        for (int k = 0; k < count; ++k) {
          const double along = k - (count - 1) / 2.0;
          const Point at{along * std::cos(direction), along * std::sin(direction)};
          movers.push_back({at, map.Way(at)});
        }
        // Beside the row, where nothing but the turn says where to go.
        const Point beside{-0.5 * std::sin(direction), 0.5 * std::cos(direction)};
        EXPECT_LT(Distance(*Carried(movers, beside), map.Of(beside)), 0.05)
            << count << " movers at " << direction << " turned by " << angle;
      }
    }
  }
}

TEST(ParticleMotion, MoversAtOnePlaceCarryByTheirMean) {
  const std::vector<Mover> movers = {{{1, 1}, {2, 0}}, {{1, 1}, {0, 2}}, {{1, 1}, {1, 1}}};
  const Point carried = *Carried(movers, {0, 0.5});
  EXPECT_NEAR(carried.x, 1, 1e-12);
  EXPECT_NEAR(carried.y, 1.5, 1e-12);
}

TEST(ParticleMotion, NothingIsLostFarFromTheOrigin) {
  support::Random random(3);
  for (const double far : {-0x1p30, 0x1p30}) {
    // Movers at multiples of 2^-20, so that they are the same there.
    const auto rounded = [](double value) { return std::round(value * 0x1p20) * 0x1p-20; };
    for (int trial = 0; trial < 50; ++trial) {
      const Map map = Map::Turn(random.Uniform(-3, 3), {});
      std::vector<Mover> here, there;
      for (int k = 0; k < 30; ++k) {
        const Point at{rounded(random.Uniform(-3, 3)), rounded(random.Uniform(-3, 3))};
        const Point way{rounded(map.Way(at).x), rounded(map.Way(at).y)};
        here.push_back({at, way});
        there.push_back({{at.x + far, at.y - far}, {way.x - far, way.y + far / 2}});
      }
      const Point near = *Carried(here, {0.5, 0.25});
      const Point away = *Carried(there, {0.5 + far, 0.25 - far});
      EXPECT_NEAR(away.x, near.x, 0x1p-20);
      EXPECT_NEAR(away.y, near.y - far / 2, 0x1p-20);
    }
  }
}

TEST(ParticleMotion, TheUnitOfLengthChangesRoundingOnly) {
  const Map map = Map::Turn(0.4, {1, 2}, {0.3, 5});
  const Point expected = *Carried(Bank({}, map, 0.1), {0.1, 0.5});
  for (const double unit : {0x1p-20, 0.3, 0x1p20}) {
    std::vector<Mover> movers = Bank({}, map, 0.1);
    for (Mover& mover : movers) {
      mover = {{unit * mover.at.x, unit * mover.at.y}, {unit * mover.way.x, unit * mover.way.y}};
    }
    const Point carried = *Carried(movers, {unit * 0.1, unit * 0.5}, unit * kReach);
    EXPECT_NEAR(carried.x, unit * expected.x, 1e-12 * unit);
    EXPECT_NEAR(carried.y, unit * expected.y, 1e-12 * unit);
  }
}

TEST(ParticleMotion, AnotherOrderOfMoversChangesRoundingOnly) {
  support::Random random(9);
  std::vector<Mover> movers = Bank({}, Map::Turn(0.3, {5, 5}, {1000, 3}), 0.2);
  const Point expected = *Carried(movers, {0.1, 0.5});
  for (int trial = 0; trial < 20; ++trial) {
    for (std::size_t k = movers.size(); k > 1; --k)
      std::swap(movers[k - 1], movers[random.Below(k)]);
    const Point carried = *Carried(movers, {0.1, 0.5});
    EXPECT_NEAR(carried.x, expected.x, 1e-11);
    EXPECT_NEAR(carried.y, expected.y, 1e-11);
  }
}

TEST(ParticleMotion, AMoverAtTheRimOfTheReachIsHardlyHeardOf) {
  std::vector<Mover> movers = Bank({}, {});
  const Point p{0.1, 0.5};
  const Point without = *Carried(movers, p);
  movers.push_back({{p.x + 0.99 * kReach, p.y}, {1, 1}});
  const Point with = *Carried(movers, p);
  EXPECT_NE(with, without);
  EXPECT_LT(Distance(with, without), 1e-4);
}

TEST(ParticleMotion, OfACrowdThoseThatCameFirstAreHeardOf) {
  std::vector<Mover> movers(200, {{1, 1}, {0.25, 0.5}});
  const auto carried = Carried(movers, {1.5, 1});
  ASSERT_TRUE(carried);
  EXPECT_NEAR(carried->x, 1.75, 1e-12);
  movers.resize(100'000, {{1, 1}, {-0.75, 0.5}});
  EXPECT_EQ(Carried(movers, {1.5, 1}), carried);
}

TEST(ParticleMotion, WhatMoversDoAtWorstIsFinite) {
  support::Random random(11);
  const auto number = [&] {
    constexpr double kHard[] = {0, 0x1p31, -0x1p31, 1e-300, -1e-160, 0.5, 3};
    return random.Chance(0.5) ? kHard[random.Below(7)] : random.Uniform(-3, 3);
  };
  for (int trial = 0; trial < 20'000; ++trial) {
    std::vector<Mover> movers(1 + random.Below(8));
    for (Mover& mover : movers) {
      const Point at{number(), number()};
      mover = {at, {number() - at.x, number() - at.y}};
    }
    for (const double reach : {0.75, 12.0}) {
      const auto carried = Carried(movers, {number(), number()}, reach);
      if (!carried) continue;
      // As PointBuckets requires of them.
      EXPECT_LT(std::abs(carried->x), 0x1p50);
      EXPECT_LT(std::abs(carried->y), 0x1p50);
    }
  }
}

}  // namespace
}  // namespace partiemc
