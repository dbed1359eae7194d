// Compares the support sums of a plane with a plain sum over all particles.
#include "vertices/plane_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "support/instruction_sets.h"
#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

// Rows of particles in one band. `xs` are stored modulo kColumnPeriod; the disc contains all.
NeighbourRows OneBand(const std::vector<float>& xs, const std::vector<float>& ys,
                      const float* weights, NeighbourBand band, float origin_x, float origin_y) {
  NeighbourRows near;
  near.x = xs.data();
  near.y = ys.data();
  near.weight = weights;
  near.size = nullptr;
  near.reach = 100;
  near.reach_per_size = 0;
  near.origin_x = origin_x;
  near.origin_y = band.origin_y = origin_y;
  near.column = origin_x < 0 ? origin_x + kColumnPeriod : origin_x;
  near.centre_x = near.centre_y = 0;
  near.reach_square = 1e4f;
  near.bands[0] = band;
  near.band_count = 1;
  return near;
}

// A position, rounded like a particle's, so that it is the same after any period.
float RoundedPosition(double position) {
  return static_cast<float>(std::round(position * 131072) / 131072);
}

float InPeriod(float x) { return x < 0 ? x + kColumnPeriod : x; }

// Particles in rows of 3 buckets, with more particles behind each row, which must not count.
struct Rows {
  explicit Rows(support::Random& random) {
    // Sometimes more particles than are summed at once, in one bucket or in several.
    const double most = random.Chance(0.2) ? random.Uniform(4, 400) : 4;
    offsets.push_back(0);
    for (int row = 0; row < 5; ++row) {
      for (int bucket = 0; bucket < 4; ++bucket) {
        for (int n = static_cast<int>(random.Uniform(0, most)); n > 0; --n) {
          x.push_back(RoundedPosition(random.Uniform(-3, 3)));
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

  NeighbourRows AsNear(bool weighted) const {
    const NeighbourBand band{
        .offsets = offsets.data(), .columns = 3, .rows = 5, .row_stride = 4, .origin_y = 0};
    return OneBand(columns, y, weighted ? weight.data() : nullptr, band, -1, 1);
  }

  std::vector<float> x, columns, y, weight;
  std::vector<bool> is_near;
  std::vector<std::uint32_t> offsets;
};

constexpr SupportShape kShape{.radius = 2.4, .height = 1.1, .spacing = 0.9, .depth = 2};

double Bump(double distance, double reach) {
  const double t = std::max(0.0, 1 - distance * distance / (reach * reach));
  return t * t;
}

SupportSums SumSupport(const NeighbourRows& near, const BentPlane& plane,
                       const SupportShape& support) {
  const SupportQuery query{near, {&plane, 1}};
  QuerySupports sums;
  SumSupports({&query, 1}, support, {&sums, 1});
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
  for (std::uint64_t seed = 0; seed < support::Tries(200u); ++seed) {
    support::Random random(seed);
    const Rows rows(random);
    const BentPlane plane = RandomPlane(random);
    double sum = 0, weight = 0, squares = 0;
    for (std::size_t k = 0; k < rows.is_near.size(); ++k) {
      const double dx = rows.x[k] - plane.x;
      const double dy = rows.y[k] - plane.y;
      const double along = plane.normal_x * dy - plane.normal_y * dx;
      const double above = plane.normal_x * dx + plane.normal_y * dy;
      const double distance = above + plane.curvature * along * along / 2;
      if (!rows.is_near[k]) continue;
      const double apart = std::hypot(dx, dy);
      if (apart >= kShape.radius || above >= kShape.height) continue;
      const double w = Bump(apart, kShape.radius) *
                       std::pow(std::max(0.0, distance / kShape.spacing + kShape.depth), 8);
      weight += w;
      sum += w * distance;
      squares += w * distance * distance;
    }
    for (const bool weighted : {false, true}) {
      const SupportSums sums = SumSupport(rows.AsNear(weighted), plane, kShape);
      // The sums of a full support are about a thousand and ten.
      EXPECT_NEAR(sums.weight, weight, 1e-5 * std::max(weight, 1.0)) << "seed " << seed;
      EXPECT_NEAR(sums.distance, sum, 1e-5 * std::max(weight, 1.0)) << "seed " << seed;
      EXPECT_NEAR(sums.square, squares, 1e-5 * std::max(weight, 1.0)) << "seed " << seed;
    }
  }
}

TEST(PlaneSupport, AgreesWithASumOverParticlesOfDifferentSizes) {
  SupportShape shape = kShape;
  shape.lift = shape.spacing / 2;
  for (std::uint64_t seed = 0; seed < support::Tries(200u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    support::Random random(seed);
    const Rows rows(random);
    BentPlane plane = RandomPlane(random);
    plane.size = random.Uniform(.5, 2);
    double sum = 0, weight = 0, squares = 0;
    for (std::size_t k = 0; k < rows.is_near.size(); ++k) {
      const double dx = rows.x[k] - plane.x, dy = rows.y[k] - plane.y;
      const double size = rows.weight[k];
      const double along = (plane.normal_x * dy - plane.normal_y * dx) / plane.size;
      // The boundary lies half the size above the particle.
      const double boundary = plane.normal_x * dx + plane.normal_y * dy + size * shape.spacing / 2;
      const double above = boundary / plane.size - shape.spacing / 2;
      const double distance = above + plane.size * plane.curvature * along * along / 2;
      const double apart = std::hypot(along, above);
      if (!rows.is_near[k] || apart >= shape.radius || above >= shape.height) continue;
      const double w = size / plane.size * Bump(apart, shape.radius) *
                       std::pow(std::max(0.0, distance / shape.spacing + shape.depth), 8);
      weight += w;
      sum += w * distance;
      squares += w * distance * distance;
    }
    NeighbourRows near = rows.AsNear(false);
    near.size = rows.weight.data();
    const SupportSums sums = SumSupport(near, plane, shape);
    EXPECT_NEAR(sums.weight, weight, 1e-5 * std::max(weight, 1.0));
    EXPECT_NEAR(sums.distance, sum, 1e-5 * std::max(weight, 1.0));
    EXPECT_NEAR(sums.square, squares, 1e-5 * std::max(weight, 1.0));
  }
}

TEST(PlaneSupport, BatchHasTheBitsOfSinglePlanes) {
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
      SumSupports(queries, kShape, all);
      for (std::size_t q = 0; q < queries.size(); ++q) {
        for (std::size_t k = 0; k < queries[q].planes.size(); ++k) {
          const SupportSums alone = SumSupport(queries[q].near, queries[q].planes[k], kShape);
          EXPECT_EQ(all[q][k].distance, alone.distance);
          EXPECT_EQ(all[q][k].weight, alone.weight);
          EXPECT_EQ(all[q][k].square, alone.square);
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
    const NeighbourRows near = rows.AsNear(round % 2 == 1);
    std::vector<SupportSums> results;
    support::ForEachInstructionSet([&] { results.push_back(SumSupport(near, plane, kShape)); });
    for (const SupportSums& result : results) {
      EXPECT_EQ(result.distance, results[0].distance);
      EXPECT_EQ(result.weight, results[0].weight);
      EXPECT_EQ(result.square, results[0].square);
    }
  }
}

}  // namespace
}  // namespace partiemc
