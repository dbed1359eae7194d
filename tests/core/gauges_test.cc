// Gauges against analytic shapes: polygons with known intersections, and particles in a pool, in
// drops on a wall and in piles.
#include "partiemc/gauges.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "support/particles.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::IsNan;
using testing::Pointwise;

Result ResultOf(const Particles& particles, double spacing) {
  const auto reconstructor =
      Reconstructor::Create({.fill = Fill::kNone, .spacing = spacing}).value();
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status =
      reconstructor.Reconstruct(particles.AsFrame(), state, workspace, result);
  EXPECT_TRUE(status.ok()) << status;
  return result;
}

std::vector<double> Reading(std::string_view text, const Result& result) {
  const auto gauge = ParseGauge(text);
  EXPECT_TRUE(gauge.ok()) << gauge.status();
  return gauge.ok() ? Measure(*gauge, result) : std::vector<double>();
}

void AddRing(Result& result, const std::vector<double>& points, std::uint32_t outer, double area) {
  Rings& rings = result.rings;
  rings.points.insert(rings.points.end(), points.begin(), points.end());
  rings.offsets.push_back(static_cast<std::uint32_t>(rings.points.size() / 2));
  rings.outer_of.push_back(outer);
  rings.measures.push_back({.area = area});
}

// The square [0, 4] x [0, 4] with the hole [1, 2] x [1, 3], and the triangle (6, 0), (8, 0), (7,
// 2).
Result Shapes() {
  Result result;
  AddRing(result, {0, 0, 4, 0, 4, 4, 0, 4}, kNoRing, 16);
  AddRing(result, {1, 1, 1, 3, 2, 3, 2, 1}, 0, -2);
  AddRing(result, {6, 0, 8, 0, 7, 2}, kNoRing, 2);
  return result;
}

TEST(GaugesTest, HeightsAreExact) {
  const Result shapes = Shapes();
  EXPECT_THAT(HeightsAt(shapes.rings, 1.5), ElementsAre(0, 1, 3, 4));
  EXPECT_THAT(Reading("h=height:1.5", shapes), ElementsAre(4, 0, 4));
  EXPECT_THAT(Reading("h=height:6.5", shapes), ElementsAre(1, 0, 2));
  EXPECT_THAT(Reading("h=height:5", shapes), ElementsAre(IsNan(), IsNan(), 0));
}

TEST(GaugesTest, CrossesAnEvenNumberOfTimesAtVertices) {
  const Result shapes = Shapes();
  for (const double x : {0.0, 1.0, 2.0, 4.0, 6.0, 7.0, 8.0}) {
    EXPECT_EQ(HeightsAt(shapes.rings, x).size() % 2, 0u) << x;
  }
}

TEST(GaugesTest, FindsTheFrontAlongADirection) {
  EXPECT_THAT(Reading("f=front:2,0", Shapes()), ElementsAre(8, 8, 0));
  EXPECT_THAT(Reading("f=front:0,-1", Shapes()), ElementsAre(0, 0, 0));
  EXPECT_THAT(Reading("f=front:1,0", Result()), ElementsAre(IsNan(), IsNan(), IsNan()));
}

TEST(GaugesTest, MeasuresTheWettedPartOfASegment) {
  EXPECT_THAT(Reading("w=wetted:-1,2,9,2", Shapes()), ElementsAre(DoubleNear(3, 1e-12)));
  EXPECT_THAT(Reading("w=wetted:0.5,2,1.5,2", Shapes()), ElementsAre(DoubleNear(0.5, 1e-12)));
  EXPECT_THAT(Reading("w=wetted:7,-1,7,5", Shapes()), ElementsAre(DoubleNear(2, 1e-12)));
  // The bottoms of the square and of the triangle, in both directions; the side of the hole.
  EXPECT_THAT(Reading("w=wetted:-1,0,9,0", Shapes()), ElementsAre(DoubleNear(6, 1e-12)));
  EXPECT_THAT(Reading("w=wetted:9,0,-1,0", Shapes()), ElementsAre(DoubleNear(6, 1e-12)));
  EXPECT_THAT(Reading("w=wetted:2,0,2,4", Shapes()), ElementsAre(DoubleNear(4, 1e-12)));
  // The tip of the triangle.
  EXPECT_THAT(Reading("w=wetted:5,2,9,2", Shapes()), ElementsAre(DoubleNear(0, 1e-12)));
}

TEST(GaugesTest, MeasuresTheAreaInABox) {
  EXPECT_THAT(Reading("b=box:0,0,4,2", Shapes()),
              Pointwise(DoubleNear(1e-12), {7.0, 14.5 / 7, 6.5 / 7}));
  EXPECT_THAT(Reading("b=box:5,5,6,6", Shapes()), ElementsAre(0, IsNan(), IsNan()));
}

TEST(GaugesTest, AreasOfBoxesAddUp) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Result result = ResultOf(support::RandomScene(seed), 1);
    double min_x = INFINITY, min_y = INFINITY, max_x = -INFINITY, max_y = -INFINITY;
    for (std::size_t k = 0; k < result.rings.PointCount(); ++k) {
      min_x = std::min(min_x, result.rings.points[2 * k]);
      max_x = std::max(max_x, result.rings.points[2 * k]);
      min_y = std::min(min_y, result.rings.points[2 * k + 1]);
      max_y = std::max(max_y, result.rings.points[2 * k + 1]);
    }
    if (!(min_x < max_x)) continue;
    constexpr int kBoxes = 7;
    const double width = (max_x - min_x) / kBoxes, height = (max_y - min_y) / kBoxes;
    double area = 0;
    for (int i = 0; i < kBoxes; ++i) {
      for (int j = 0; j < kBoxes; ++j) {
        const double x = min_x + i * width, y = min_y + j * height;
        area += Measure(
            {.name = "b", .kind = GaugeKind::kBox, .numbers = {x, y, x + width, y + height}},
            result)[0];
      }
    }
    EXPECT_NEAR(area, result.statistics.area, 1e-9 * result.statistics.area) << seed;
  }
}

// Discs that touch, in a square or hexagonal lattice, with a diameter of 1.
Particles DiscLattice(bool hexagonal) {
  const double height = hexagonal ? std::sqrt(3) / 2 : 1;
  Particles discs;
  for (int j = 0; j < 24; ++j) {
    for (int i = 0; i < 24; ++i) discs.Add(i + (hexagonal && j % 2 == 1 ? 0.5 : 0), j * height);
  }
  return discs;
}

std::vector<double> Packing(const Result& result, const Particles& particles, double radius,
                            const std::vector<double>& box) {
  const Frame frame = particles.AsFrame();
  const auto& given = std::get<std::span<const double>>(frame.positions);
  const std::vector<float> areas(given.size() / 2,
                                 static_cast<float>(std::numbers::pi * radius * radius));
  return Measure({.name = "p", .kind = GaugeKind::kPacking, .numbers = box}, result,
                 {given, areas});
}

TEST(GaugesTest, PackingOfLatticesIsThatOfTheirCells) {
  for (const bool hexagonal : {false, true}) {
    const Particles discs = DiscLattice(hexagonal);
    const Result result = ResultOf(discs, 1);
    const double height = hexagonal ? std::sqrt(3) / 2 : 1;
    const double expected = std::numbers::pi / (hexagonal ? 2 * std::sqrt(3) : 4);
    // Boxes of whole cells, at any place.
    for (double shift = 0; shift < 1; shift += 0.13) {
      const std::vector<double> packing =
          Packing(result, discs, 0.5,
                  {4 + shift, (4 + 2 * shift) * height, 12 + shift, (12 + 2 * shift) * height});
      EXPECT_NEAR(packing[0], expected, 1e-6) << hexagonal << " " << shift;
      EXPECT_NEAR(packing[2], 64 * height, 1e-9);
    }
  }
}

// The parts of a disc in the cells of a grid add up to the disc.
TEST(GaugesTest, DiscsAreDividedExactlyBetweenBoxes) {
  Random random(9);
  for (int n = 0; n < 200; ++n) {
    Particles disc;
    disc.Add(random.Uniform(-1, 1), random.Uniform(-1, 1));
    const double radius = random.Uniform(0.01, 2);
    double sum = 0;
    for (int i = -8; i < 8; ++i) {
      for (int j = -8; j < 8; ++j) {
        sum += Packing(Result(), disc, radius, {i / 2.0, j / 2.0, (i + 1) / 2.0, (j + 1) / 2.0})[1];
      }
    }
    const double area = std::numbers::pi * radius * radius;
    EXPECT_NEAR(sum, area, 1e-6 * area);
  }
}

TEST(GaugesTest, DiscsInBoxesHaveKnownAreas) {
  Particles disc;
  disc.Add(0, 0);
  const double pi = std::numbers::pi;
  const auto area_in = [&](const std::vector<double>& box) {
    return Packing(Result(), disc, 1, box)[1];
  };
  EXPECT_NEAR(area_in({-2, -2, 2, 2}), pi, 1e-6);
  EXPECT_NEAR(area_in({0, -2, 2, 2}), pi / 2, 1e-6);
  EXPECT_NEAR(area_in({0, 0, 5, 5}), pi / 4, 1e-6);
  EXPECT_NEAR(area_in({-0.5, -0.5, 0.5, 0.5}), 1, 1e-6);
  EXPECT_NEAR(area_in({0.5, -2, 2, 2}), pi / 3 - std::sqrt(3) / 4, 1e-6);
  EXPECT_EQ(area_in({1, 1, 2, 2}), 0);
  EXPECT_EQ(area_in({0.8, 0.8, 2, 2}), 0);
  EXPECT_EQ(area_in({-3, 1.5, 3, 2}), 0);
}

TEST(GaugesTest, PackingIsUnknownWithoutDiscsOrOutline) {
  const Result shapes = Shapes();
  EXPECT_THAT(Reading("p=packing:0,0,4,4", shapes), ElementsAre(IsNan(), IsNan(), 14));
  Particles disc;
  disc.Add(5, 5);
  EXPECT_THAT(Packing(shapes, disc, 0.1, {4.5, 4.5, 5.5, 5.5}),
              ElementsAre(IsNan(), DoubleNear(0.01 * std::numbers::pi, 1e-8), 0));
}

// The true boundary of a body is half a spacing outside its outermost particles.
TEST(GaugesTest, SurfaceHeightOfAPoolIsWithinATwentiethOfASpacing) {
  Random random(5);
  Particles pool;
  for (int j = 0; j < 30; ++j) {
    for (int i = 0; i < 100; ++i) {
      pool.Add(0.01 * (i + 0.5 + random.Uniform(-0.05, 0.05)),
               0.01 * (j + 0.5 + random.Uniform(-0.05, 0.05)));
    }
  }
  const Result result = ResultOf(pool, 0.01);
  double worst = 0;
  for (double x = 0.1; x < 0.9; x += 0.003) {
    const auto heights = HeightsAt(result.rings, x);
    ASSERT_EQ(heights.size(), 2u);
    worst = std::max(worst, std::abs(heights[1] - 0.3));
  }
  EXPECT_LT(worst, 0.05 * 0.01);
}

// A circular drop of a radius of 20 spacings on a wall with any direction.
Particles Drop(double angle, double direction, std::uint64_t seed) {
  constexpr double kRadius = 20;
  Random random(seed);
  const double centre = -kRadius * std::cos(angle);
  const double shift = random.Uniform(0, 1);
  Particles drop;
  for (int j = 0; j < 45; ++j) {
    for (int i = -25; i < 25; ++i) {
      const double along = i + shift + random.Uniform(-0.05, 0.05);
      const double above = j + 0.5 + random.Uniform(-0.05, 0.05);
      if (std::hypot(along, above - centre) > kRadius) continue;
      drop.Add(3 + std::cos(direction) * along - std::sin(direction) * above,
               7 + std::sin(direction) * along + std::cos(direction) * above);
    }
  }
  return drop;
}

TEST(GaugesTest, ContactAnglesAreWithinFiveDegrees) {
  for (const double degrees : {30, 60, 90, 120, 150}) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      const double angle = degrees * std::numbers::pi / 180;
      const double direction = 0.7 * static_cast<double>(seed);
      const Gauge gauge{.name = "c",
                        .kind = GaugeKind::kContact,
                        .numbers = {3, 7, std::cos(direction), std::sin(direction), 40}};
      ASSERT_TRUE(Check(gauge).ok());
      const std::vector<double> values = Measure(gauge, ResultOf(Drop(angle, direction, seed), 1));
      EXPECT_NEAR(values[0], degrees, 5) << "seed " << seed;
      EXPECT_NEAR(values[1], degrees, 5) << "seed " << seed;
      // At 30 degrees an error of 1 degree moves the contact by half a spacing.
      EXPECT_NEAR(values[2], -20 * std::sin(angle), 1.5) << degrees << ", seed " << seed;
      EXPECT_NEAR(values[3], 20 * std::sin(angle), 1.5) << degrees << ", seed " << seed;
    }
  }
}

// Liquid between two vertical walls. The surface rises to both by an arc with a radius of 20.
TEST(GaugesTest, ContactAnglesOfAMeniscusAreWithinFiveDegrees) {
  for (const double degrees : {40, 60, 75}) {
    const double angle = degrees * std::numbers::pi / 180;
    const double half_width = 20 * std::cos(angle), centre = 20 + 20 * std::sin(angle);
    Random random(4);
    Particles liquid;
    for (int j = 0; j < 60; ++j) {
      for (int i = 0; i < static_cast<int>(2 * half_width); ++i) {
        const double x = i + 0.5 - half_width + random.Uniform(-0.05, 0.05);
        const double y = j + 0.5 + random.Uniform(-0.05, 0.05);
        if (y < centre && std::hypot(x, y - centre) > 20) liquid.Add(x, y);
      }
    }
    // The wall on the left runs down, so that the liquid is on its left; its start is the surface.
    const Gauge gauge{
        .name = "c", .kind = GaugeKind::kContact, .numbers = {-half_width, 0, 0, -1, half_width}};
    const std::vector<double> values = Measure(gauge, ResultOf(liquid, 1));
    EXPECT_NEAR(values[0], degrees, 5);
    EXPECT_NEAR(values[2], -20, 1);
  }
}

TEST(GaugesTest, ABoxInAHoleIsEmpty) {
  Result ring;
  std::vector<double> outer, hole;
  for (int k = 0; k < 64; ++k) {
    const double angle = k * std::numbers::pi / 32;
    for (auto* const points : {&outer, &hole}) {
      const double radius = points == &outer ? 1 : 0.5, turn = points == &outer ? 1 : -1;
      points->push_back(0.0137 + radius * std::cos(turn * angle));
      points->push_back(0.0291 + radius * std::sin(turn * angle));
    }
  }
  AddRing(ring, outer, kNoRing, std::numbers::pi);
  AddRing(ring, hole, 0, -std::numbers::pi / 4);
  EXPECT_THAT(Reading("b=box:.1,.1,.3,.3", ring), ElementsAre(0, IsNan(), IsNan()));
  EXPECT_THAT(Reading("b=box:-.07,-.13,.11,.17", ring), ElementsAre(0, IsNan(), IsNan()));
}

TEST(GaugesTest, AnglesOfReposeAreWithinTwoDegrees) {
  for (const double degrees : {15, 25, 35}) {
    const double slope = std::tan(degrees * std::numbers::pi / 180);
    Random random(3);
    Particles pile;
    for (int j = 0; j < 60; ++j) {
      for (int i = -150; i < 150; ++i) {
        const double x = i + 0.5 + random.Uniform(-0.1, 0.1);
        const double y = j + 0.5 + random.Uniform(-0.1, 0.1);
        // The right flank is half as steep as the left one.
        if (y <= 30 + (x < 0 ? slope * x : -slope / 2 * x)) pile.Add(x, y);
      }
    }
    const std::vector<double> values = Reading("r=repose", ResultOf(pile, 1));
    EXPECT_NEAR(values[0], degrees, 2);
    EXPECT_NEAR(values[1], std::atan(slope / 2) * 180 / std::numbers::pi, 2);
  }
}

TEST(GaugesTest, AGaugeOfNothingHasNoValues) {
  for (const GaugeTraits& traits : AllGauges()) {
    Gauge gauge{.name = "g", .kind = traits.kind};
    for (std::size_t k = 0; k < traits.numbers.size(); ++k) {
      gauge.numbers.push_back(static_cast<double>(k + 1));
    }
    ASSERT_TRUE(Check(gauge).ok()) << traits.name;
    EXPECT_EQ(Measure(gauge, Result()).size(), traits.values.size()) << traits.name;
    EXPECT_EQ(&TraitsOf(traits.kind), &traits);
  }
}

TEST(GaugesTest, ParsesNamesKindsAndNumbers) {
  const Gauge gauge = ParseGauge("left_wall=contact:0,0,1,0,0.2").value();
  EXPECT_EQ(gauge.name, "left_wall");
  EXPECT_EQ(gauge.kind, GaugeKind::kContact);
  EXPECT_THAT(gauge.numbers, ElementsAre(0, 0, 1, 0, 0.2));
  EXPECT_TRUE(ParseGauge("slope=repose").ok());
}

TEST(GaugesTest, RefusesTextsThatAreNoGauges) {
  for (const char* text : {"",
                           "height:1",
                           "=height:1",
                           "a b=height:1",
                           "a=depth:1",
                           "a=height",
                           "a=height:1,2",
                           "a=height:x",
                           "a=height:nan",
                           "a=height:1e99",
                           "a=front:0,0",
                           "a=wetted:1,1,1,1",
                           "a=box:0,0,0,1",
                           "a=contact:0,0,0,0,1",
                           "a=contact:0,0,1,0,0",
                           "a=repose:1",
                           "a=height:0.5,",
                           "a=height:,0.5",
                           "a=box:0,0,,1,1",
                           "a=height:",
                           "a=repose:"}) {
    const auto gauge = ParseGauge(text);
    EXPECT_EQ(gauge.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_TRUE(FindViolation(gauge.status()).has_value()) << text;
  }
}

}  // namespace
}  // namespace partiemc
