// What particles say of a plane, against a plain sum over all particles.
#include "plane_support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "support/instruction_sets.h"
#include "support/random.h"

namespace partiemc {
namespace {

// Particles in rows of 3 buckets, with more particles behind each row, which must not count.
struct Rows {
  explicit Rows(support::Random& random) {
    offsets.push_back(0);
    for (int row = 0; row < 5; ++row) {
      for (int bucket = 0; bucket < 4; ++bucket) {
        for (int n = static_cast<int>(random.Uniform(0, 4)); n > 0; --n) {
          x.push_back(static_cast<float>(random.Uniform(-3, 3)));
          y.push_back(static_cast<float>(random.Uniform(-3, 3)));
          is_near.push_back(bucket < 3);
        }
        offsets.push_back(static_cast<std::uint32_t>(x.size()));
      }
    }
    x.resize(x.size() + kPointPadding);
    y.resize(y.size() + kPointPadding);
  }

  NearRows AsNear() const {
    return {.x = x.data(),
            .y = y.data(),
            .offsets = offsets.data(),
            .rows = 5,
            .columns = 3,
            .row_stride = 4};
  }

  std::vector<float> x, y;
  std::vector<bool> is_near;
  std::vector<std::uint32_t> offsets;
};

constexpr SupportShape kShape{
    .radius = 2.4, .half_width = 1.9, .height = 1.1, .spacing = 0.9, .depth = 2};

BentPlane RandomPlane(support::Random& random) {
  const double angle = random.Uniform(0, 6.3);
  return {.x = random.Uniform(-1, 1),
          .y = random.Uniform(-1, 1),
          .normal_x = std::cos(angle),
          .normal_y = std::sin(angle),
          .curvature = random.Uniform(-0.3, 0.3)};
}

TEST(PlaneSupport, AgreesWithASumOverAllParticles) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    support::Random random(seed);
    const Rows rows(random);
    const BentPlane plane = RandomPlane(random);
    double sum = 0, weight = 0;
    for (std::size_t k = 0; k < rows.is_near.size(); ++k) {
      const double dx = rows.x[k] - plane.x;
      const double dy = rows.y[k] - plane.y;
      const double along = plane.normal_x * dy - plane.normal_y * dx;
      const double above = plane.normal_x * dx + plane.normal_y * dy;
      const double distance = above + plane.curvature * along * along / 2;
      if (!rows.is_near[k] || std::hypot(dx, dy) >= kShape.radius || above >= kShape.height) {
        continue;
      }
      const double t = std::max(0.0, 1 - along * along / (kShape.half_width * kShape.half_width));
      const double w = t * t * std::pow(std::max(0.0, distance / kShape.spacing + kShape.depth), 8);
      sum += w * distance;
      weight += w;
    }
    const SupportSums sums = SumSupport(rows.AsNear(), kShape, plane);
    EXPECT_NEAR(sums.weight, weight, 1e-12 * weight) << "seed " << seed;
    EXPECT_NEAR(sums.distance, sum, 1e-11 * weight) << "seed " << seed;
  }
}

TEST(PlaneSupport, HasTheSameBitsForAnyInstructionSet) {
  support::Random random(4);
  for (int round = 0; round < 50; ++round) {
    const Rows rows(random);
    const BentPlane plane = RandomPlane(random);
    std::vector<SupportSums> results;
    support::ForEachInstructionSet(
        [&] { results.push_back(SumSupport(rows.AsNear(), kShape, plane)); });
    for (const SupportSums& result : results) {
      EXPECT_EQ(result.distance, results[0].distance);
      EXPECT_EQ(result.weight, results[0].weight);
    }
  }
}

}  // namespace
}  // namespace partiemc
