// Compares the margins of periodic rings with walks along the ring.
#include "vertices/periodic_ring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

// A square of side 20. Many nearly coincident vertices lie at the distance `reach` from the first
// vertex, in both directions.
std::vector<Point> CrowdedSquare(support::Random& random, double reach) {
  std::vector<double> at;
  for (int k = 0; k < 80; ++k) at.push_back(k + (k == 0 ? 0 : random.Uniform(-0.4, 0.4)));
  for (const double crowd : {reach, 80 - reach}) {
    for (int k = 0; k < 60; ++k) at.push_back(crowd + random.Uniform(-2e-6, 2e-5));
  }
  std::sort(at.begin(), at.end());
  std::vector<Point> ring;
  for (const double s : at) {
    const double along = std::fmod(s, 20);
    switch (static_cast<int>(s / 20)) {
      case 0:
        ring.push_back({along, 0});
        break;
      case 1:
        ring.push_back({20, along});
        break;
      case 2:
        ring.push_back({20 - along, 20});
        break;
      default:
        ring.push_back({0, 20 - along});
        break;
    }
  }
  return ring;
}

// As windows judge it (ring_filters.cc).
bool IsNear(std::int64_t units, double reach) {
  const double reach_units = reach * kRingUnitsPerCell;
  const auto distance = static_cast<float>(units);
  return 1.0f - distance * distance * static_cast<float>(1 / (reach_units * reach_units)) > 0;
}

TEST(PeriodicRings, MarginsHoldEveryVertexOfAWindow) {
  for (unsigned seed = 1; seed <= support::Tries(300u); ++seed) {
    support::Random random(seed);
    const double reach = random.Uniform(3, 18);
    const std::vector<Point> ring = CrowdedSquare(random, reach);
    const std::size_t count = ring.size();
    const auto size = SizeForWindows(ring, {}, reach);
    ASSERT_EQ(size.count, count);
    const auto step = [&](std::size_t k) {
      const Point &from = ring[k % count], &to = ring[(k + 1) % count];
      return LengthInUnits(RingUnits(to.x) - RingUnits(from.x),
                           RingUnits(to.y) - RingUnits(from.y));
    };
    std::size_t near_after = 0, near_before = 0;
    std::int64_t after = step(count - 1), before = after;
    for (std::size_t k = 1; k < count / 2; ++k) {
      if (IsNear(after, reach)) near_after = k;
      if (IsNear(before, reach)) near_before = k;
      after += step(k - 1);
      before += step(count - 1 - k);
    }
    EXPECT_GE(size.margin, near_after) << "seed " << seed;
    EXPECT_GE(size.margin, near_before) << "seed " << seed;
    EXPECT_LE(size.margin, std::max(near_after, near_before) + 60) << "seed " << seed;
  }
}

}  // namespace
}  // namespace partiemc
