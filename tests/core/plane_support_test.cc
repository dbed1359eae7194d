// What particles say of a plane, against a plain sum over all particles.
#include "plane_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "support/instruction_sets.h"
#include "support/random.h"

namespace partiemc {
namespace {

// Rows of particles in one band. `xs` are told modulo kColumnPeriod; the disc has all.
NearRows OneBand(const std::vector<float>& xs, const std::vector<float>& ys, const float* weights,
                 NearBand band, float origin_x, float origin_y) {
  NearRows near;
  near.x = xs.data();
  near.y = ys.data();
  near.weight = weights;
  near.origin_x = origin_x;
  near.origin_y = band.origin_y = origin_y;
  near.column = origin_x < 0 ? origin_x + kColumnPeriod : origin_x;
  near.centre_x = near.centre_y = 0;
  near.reach_square = 1e4f;
  near.bands[0] = band;
  near.band_count = 1;
  return near;
}

// A position, rounded as those of particles are, so that it is the same after any period.
float Rounded(double position) {
  return static_cast<float>(std::round(position * 131072) / 131072);
}

float InPeriod(float x) { return x < 0 ? x + kColumnPeriod : x; }

// Particles in rows of 3 buckets, with more particles behind each row, which must not count.
struct Rows {
  explicit Rows(support::Random& random) {
    // Now and then more than are summed at once, in one bucket or in several.
    const double most = random.Chance(0.2) ? random.Uniform(4, 400) : 4;
    offsets.push_back(0);
    for (int row = 0; row < 5; ++row) {
      for (int bucket = 0; bucket < 4; ++bucket) {
        for (int n = static_cast<int>(random.Uniform(0, most)); n > 0; --n) {
          x.push_back(Rounded(random.Uniform(-3, 3)));
          columns.push_back(InPeriod(x.back()));
          y.push_back(static_cast<float>(random.Uniform(-3, 3)));
          weight.push_back(static_cast<float>(random.Uniform(0.5, 2)));
          is_near.push_back(bucket < 3);
        }
        offsets.push_back(static_cast<std::uint32_t>(x.size()));
      }
    }
    columns.resize(x.size() + kRowPadding);
    x.resize(x.size() + kRowPadding);
    y.resize(y.size() + kRowPadding);
    weight.resize(weight.size() + kRowPadding);
  }

  NearRows AsNear(bool weighted) const {
    const NearBand band{
        .offsets = offsets.data(), .columns = 3, .rows = 5, .row_stride = 4, .origin_y = 0};
    return OneBand(columns, y, weighted ? weight.data() : nullptr, band, -1, 1);
  }

  std::vector<float> x, columns, y, weight;
  std::vector<bool> is_near;
  std::vector<std::uint32_t> offsets;
};

constexpr SupportShape kShape{
    .radius = 2.4, .half_width = 1.9, .height = 1.1, .spacing = 0.9, .depth = 2};
constexpr StripShape kStrip{.radius = 2.6, .half_width = 1.4, .height = 1.3, .depth = 2.3};

double Bump(double d, double reach) {
  const double t = std::max(0.0, 1 - d * d / (reach * reach));
  return t * t;
}

SupportSums SumSupport(const NearRows& near, const BentPlane& plane, const SupportShape& support,
                       const StripShape& strip) {
  const SupportQuery query{near, {&plane, 1}};
  QuerySupports sums;
  SumSupports({&query, 1}, support, strip, {&sums, 1});
  return sums[0];
}

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
    double sum = 0, weight = 0, count = 0, volume = 0;
    for (std::size_t k = 0; k < rows.is_near.size(); ++k) {
      const double dx = rows.x[k] - plane.x;
      const double dy = rows.y[k] - plane.y;
      const double along = plane.normal_x * dy - plane.normal_y * dx;
      const double above = plane.normal_x * dx + plane.normal_y * dy;
      const double distance = above + plane.curvature * along * along / 2;
      if (!rows.is_near[k]) continue;
      if (std::hypot(dx, dy) < kShape.radius && above < kShape.height) {
        const double w = Bump(along, kShape.half_width) *
                         std::pow(std::max(0.0, distance / kShape.spacing + kShape.depth), 8);
        sum += w * distance;
        weight += w;
      }
      if (std::hypot(dx, dy) < kStrip.radius && above < kStrip.height) {
        const double w =
            Bump(along, kStrip.half_width) * Bump(std::min(distance, 0.0), kStrip.depth);
        count += w;
        volume += rows.weight[k] * w;
      }
    }
    for (const bool weighted : {false, true}) {
      const SupportSums sums = SumSupport(rows.AsNear(weighted), plane, kShape, kStrip);
      // The sums of a full support are about a thousand and ten.
      EXPECT_NEAR(sums.weight, weight, 1e-5 * std::max(weight, 1.0)) << "seed " << seed;
      EXPECT_NEAR(sums.distance, sum, 1e-5 * std::max(weight, 1.0)) << "seed " << seed;
      const double expected = weighted ? volume : count;
      EXPECT_NEAR(sums.volume, expected, 1e-5 * std::max(expected, 0.01)) << "seed " << seed;
    }
  }
}

// Rows of particles a spacing apart, of which the outermost lies half a spacing inside the
// boundary.
TEST(PlaneSupport, TellsByTheVolumeOfAStripHowFarInsideOfTheBoundaryAPlaneIs) {
  constexpr StripShape kWide{.radius = 2.92, .half_width = 1.5, .height = 1.2, .depth = 2.5};
  const double width = 16.0 / 15 * kWide.half_width;
  support::Random random(8);
  for (int round = 0; round < 200; ++round) {
    const double inside = random.Uniform(-0.3, 0.3);
    const double along_rows = random.Uniform(0, 1);
    BentPlane plane = RandomPlane(random);
    plane.curvature = 0;
    std::vector<float> x, y;
    for (int row = 0; row < 5; ++row) {
      for (int k = -4; k <= 4; ++k) {
        const double above = inside - row - 0.5;
        const double along = k + along_rows;
        x.push_back(static_cast<float>(plane.x + above * plane.normal_x - along * plane.normal_y));
        y.push_back(static_cast<float>(plane.y + above * plane.normal_y + along * plane.normal_x));
      }
    }
    const std::uint32_t offsets[] = {0, static_cast<std::uint32_t>(x.size())};
    x.resize(x.size() + kRowPadding);
    y.resize(y.size() + kRowPadding);
    const NearBand band{
        .offsets = offsets, .columns = 1, .rows = 1, .row_stride = 1, .origin_y = 0};
    const NearRows near = OneBand(x, y, nullptr, band, 0, 0);
    const double volume = SumSupport(near, plane, kShape, kWide).volume;
    EXPECT_NEAR(volume / width - 8.0 / 15 * kWide.depth, inside, 0.03) << "round " << round;
  }
}

TEST(PlaneSupport, OfManyPlanesAtOnceHasTheBitsOfEachAlone) {
  support::Random random(5);
  for (int round = 0; round < 50; ++round) {
    const bool weighted = round % 2 == 1;
    std::vector<Rows> rows;
    for (std::size_t q = 0; q < kQueriesAtOnce; ++q) rows.emplace_back(random);
    std::vector<std::array<BentPlane, kPointsAtOnce>> planes(rows.size());
    std::vector<SupportQuery> queries;
    for (std::size_t q = 0; q < rows.size(); ++q) {
      for (BentPlane& plane : planes[q]) plane = RandomPlane(random);
      const std::size_t count = 1 + random.Below(kPointsAtOnce);
      queries.push_back({rows[q].AsNear(weighted), std::span(planes[q]).first(count)});
      queries.back().near.bands[0].rows = static_cast<int>(random.Below(6));
    }
    support::ForEachInstructionSet([&] {
      std::vector<QuerySupports> all(queries.size());
      SumSupports(queries, kShape, kStrip, all);
      for (std::size_t q = 0; q < queries.size(); ++q) {
        for (std::size_t k = 0; k < queries[q].planes.size(); ++k) {
          const SupportSums alone =
              SumSupport(queries[q].near, queries[q].planes[k], kShape, kStrip);
          EXPECT_EQ(all[q][k].distance, alone.distance);
          EXPECT_EQ(all[q][k].weight, alone.weight);
          EXPECT_EQ(all[q][k].volume, alone.volume);
        }
      }
    });
  }
}

TEST(PlaneSupport, HasTheSameBitsForAnyInstructionSet) {
  support::Random random(4);
  for (int round = 0; round < 50; ++round) {
    const Rows rows(random);
    const BentPlane plane = RandomPlane(random);
    const NearRows near = rows.AsNear(round % 2 == 1);
    std::vector<SupportSums> results;
    support::ForEachInstructionSet(
        [&] { results.push_back(SumSupport(near, plane, kShape, kStrip)); });
    for (const SupportSums& result : results) {
      EXPECT_EQ(result.distance, results[0].distance);
      EXPECT_EQ(result.weight, results[0].weight);
      EXPECT_EQ(result.volume, results[0].volume);
    }
  }
}

}  // namespace
}  // namespace partiemc
