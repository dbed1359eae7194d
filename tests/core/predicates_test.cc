#include "base/predicates.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "support/tries.h"

namespace partiemc {
namespace {

__extension__ using Wide = __int128;
using Engine = std::mt19937_64;

struct LatticePoint {
  std::int64_t x, y;
};

Point Scaled(const LatticePoint& point, int exponent) {
  return {std::ldexp(static_cast<double>(point.x), exponent),
          std::ldexp(static_cast<double>(point.y), exponent)};
}

/// In integers, for coordinates below 2^61.
int TrueOrientation(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  const Wide determinant = Wide{a.x - c.x} * Wide{b.y - c.y} - Wide{a.y - c.y} * Wide{b.x - c.x};
  return (determinant > 0) - (determinant < 0);
}

std::int64_t Below(Engine& random, std::int64_t bound) {
  return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(bound));
}

TEST(Orientation, IsRightOnAllTriplesOfASmallLattice) {
  std::vector<LatticePoint> lattice;
  for (std::int64_t i = 0; i < 25; ++i) lattice.push_back({i % 5 - 2, i / 5 - 2});
  for (const LatticePoint& a : lattice) {
    for (const LatticePoint& b : lattice) {
      for (const LatticePoint& c : lattice) {
        ASSERT_EQ(Orientation(Scaled(a, 0), Scaled(b, 0), Scaled(c, 0)), TrueOrientation(a, b, c));
      }
    }
  }
}

/// Points near a random line, with coordinates of all 53 bits, which no filter can decide.
TEST(Orientation, AgreesWithIntegersForPointsThatAreNearlyCollinear) {
  Engine random(1);
  int collinear = 0;
  for (int round = 0; round < support::Tries(300'000); ++round) {
    const LatticePoint step{Below(random, 1 << 20) - (1 << 19), Below(random, 1 << 20) - (1 << 19)};
    const LatticePoint start{Below(random, std::int64_t{1} << 51),
                             Below(random, std::int64_t{1} << 51)};
    std::array<LatticePoint, 3> points;
    for (LatticePoint& point : points) {
      const std::int64_t steps = Below(random, std::int64_t{1} << 30);
      point = {start.x + steps * step.x + Below(random, 3) - 1,
               start.y + steps * step.y + Below(random, 3) - 1};
    }
    const int expected = TrueOrientation(points[0], points[1], points[2]);
    collinear += expected == 0 ? 1 : 0;
    // Shifts by powers of two to the ends of the domain change no sign.
    for (const int exponent : {0, -52, -398, 445}) {
      const Point a = Scaled(points[0], exponent);
      const Point b = Scaled(points[1], exponent);
      const Point c = Scaled(points[2], exponent);
      ASSERT_EQ(Orientation(a, b, c), expected) << "seed 1, round " << round;
      ASSERT_EQ(Orientation(b, a, c), -expected) << "seed 1, round " << round;
      ASSERT_EQ(OrientationExact(c, a, b), expected) << "seed 1, round " << round;
    }
  }
  EXPECT_GT(collinear, support::Tries(1000));
}

/// Differences that are not exact, so that the whole expansion is needed.
TEST(Orientation, AgreesWithIntegersForCoordinatesOfDifferentMagnitudes) {
  Engine random(2);
  const auto coordinate = [&]() {
    // At most 53 bits, anywhere below 2^60.
    const int bits = static_cast<int>(random() % 54);
    const std::int64_t value = bits == 0 ? 0 : Below(random, std::int64_t{1} << bits);
    const std::int64_t shifted = value << (random() % static_cast<std::uint64_t>(61 - bits));
    return random() % 2 == 0 ? shifted : -shifted;
  };
  for (int round = 0; round < support::Tries(500'000); ++round) {
    const LatticePoint a{coordinate(), coordinate()};
    LatticePoint b{coordinate(), coordinate()};
    LatticePoint c{coordinate(), coordinate()};
    if (round % 2 == 0) {
      // On the line from the origin through a, or next to it.
      b = {a.x / 2, a.y / 2};
      c = {Below(random, 3) - 1, Below(random, 3) - 1};
    }
    ASSERT_EQ(Orientation(Scaled(a, -30), Scaled(b, -30), Scaled(c, -30)), TrueOrientation(a, b, c))
        << "seed 2, round " << round;
  }
}

TEST(Orientation, SeesTheLastBitOverTheWholeRangeOfMagnitudes) {
  for (const double large : {1.0, 1e60, kMaxMagnitude}) {
    for (const double small : {1.0, 1e-60, kMinMagnitude}) {
      const double more = std::nextafter(small, 2 * small);
      EXPECT_EQ(Orientation({-large, -large}, {large, large}, {small, small}), 0);
      EXPECT_EQ(Orientation({-large, -large}, {large, large}, {small, more}), 1);
      EXPECT_EQ(Orientation({-large, -large}, {large, large}, {more, small}), -1);
      EXPECT_EQ(Orientation({small, more}, {-large, -large}, {large, large}), 1);
    }
  }
}

TEST(Orientation, IsConsistentUnderPermutationForNeighbouringDoubles) {
  Engine random(3);
  for (int round = 0; round < support::Tries(100'000); ++round) {
    const double x = 0.5 + static_cast<double>(random() % 1000) / 7;
    const auto near = [&](double value) {
      for (std::uint64_t steps = random() % 3; steps > 0; --steps) {
        value = std::nextafter(value, std::numeric_limits<double>::infinity());
      }
      return value;
    };
    const Point a{near(x), near(x)}, b{near(2 * x), near(2 * x)}, c{near(3 * x), near(3 * x)};
    const int sign = Orientation(a, b, c);
    ASSERT_EQ(Orientation(b, c, a), sign) << "seed 3, round " << round;
    ASSERT_EQ(Orientation(c, b, a), -sign) << "seed 3, round " << round;
    ASSERT_EQ(Orientation({a.y, a.x}, {b.y, b.x}, {c.y, c.x}), -sign);
  }
}

TEST(Orientation, DomainHasNoRoomForWhatCannotBeComputedWith) {
  for (const double good : {0.0, -0.0, 1.0, -1e60, kMinMagnitude, -kMaxMagnitude}) {
    EXPECT_TRUE(InPredicateDomain(good)) << good;
  }
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        kMinMagnitude / 2, -2 * kMaxMagnitude, std::numeric_limits<double>::denorm_min()}) {
    EXPECT_FALSE(InPredicateDomain(bad)) << bad;
  }
}

/// By solving a + s (b - a) = c + t (d - c) in integers.
bool TrulyTouch(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                const LatticePoint& d) {
  const auto contains = [](const LatticePoint& p, const LatticePoint& q, const LatticePoint& r) {
    return TrueOrientation(p, q, r) == 0 &&
           (r.x - p.x) * (r.x - q.x) + (r.y - p.y) * (r.y - q.y) <= 0;
  };
  if (contains(a, b, c) || contains(a, b, d) || contains(c, d, a) || contains(c, d, b)) return true;
  const LatticePoint u{b.x - a.x, b.y - a.y}, v{d.x - c.x, d.y - c.y}, w{c.x - a.x, c.y - a.y};
  std::int64_t denominator = u.x * v.y - u.y * v.x;
  if (denominator == 0) return false;
  std::int64_t s = w.x * v.y - w.y * v.x;
  std::int64_t t = w.x * u.y - w.y * u.x;
  if (denominator < 0) denominator = -denominator, s = -s, t = -t;
  return s >= 0 && s <= denominator && t >= 0 && t <= denominator;
}

TEST(SegmentsTouch, AgreesWithIntegersOnASmallLatticeWithAllItsDegeneracies) {
  Engine random(4);
  int touching = 0;
  for (int round = 0; round < support::Tries(500'000); ++round) {
    std::array<LatticePoint, 4> p;
    for (LatticePoint& point : p) point = {Below(random, 5), Below(random, 5)};
    const bool expected = TrulyTouch(p[0], p[1], p[2], p[3]);
    touching += expected ? 1 : 0;
    // Thirds of a cell are rounded, but equal coordinates stay equal and collinear points on the
    // axes and diagonals stay collinear; whole cells far away are exact.
    for (const double shift : {0.0, 1e6}) {
      std::array<Point, 4> q;
      for (std::size_t i = 0; i < 4; ++i) {
        q[i] = {shift + static_cast<double>(p[i].x), shift - static_cast<double>(p[i].y)};
      }
      ASSERT_EQ(SegmentsTouch(q[0], q[1], q[2], q[3]), expected) << "seed 4, round " << round;
      ASSERT_EQ(SegmentsTouch(q[3], q[2], q[0], q[1]), expected) << "seed 4, round " << round;
    }
  }
  EXPECT_GT(touching, support::Tries(100'000));
  EXPECT_LT(touching, 400'000);
}

TEST(SegmentsTouch, TellsATouchFromAMissByTheLastBit) {
  const Point a{0, 0}, b{3, 1};
  const Point above{1.5, 2};
  const double y = 0.5;
  EXPECT_TRUE(SegmentsTouch(a, b, above, {1.5, y}));
  EXPECT_FALSE(SegmentsTouch(a, b, above, {1.5, std::nextafter(y, 1)}));
  EXPECT_TRUE(SegmentsTouch(a, b, above, {1.5, std::nextafter(y, 0)}));
}

}  // namespace
}  // namespace partiemc
