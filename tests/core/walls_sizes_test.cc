// Walls of outlines whose particles have their own sizes.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/instruction_sets.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/sized_scenes.h"
#include "support/tries.h"
#include "support/wall_scenes.h"

namespace partiemc {
namespace {

using support::Body;
using support::Particles;
using support::Random;
using support::ReconstructOnce;
using support::WallFrame;

// A tank, and a column of particles of one size in it, `gap` above its floor.
constexpr double kTankWidth = 24;
const Wall kHighTank{{0, 99, 0, 0, kTankWidth, 0, kTankWidth, 99}};
Particles ColumnOfSize(double size, double gap) {
  const int columns = static_cast<int>(std::lround(kTankWidth / size));
  Particles column = support::Scaled(support::Lattice(columns, 12, .5, .5), size);
  column = support::Shifted(column, 0, gap);
  column.volumes.assign(column.size(), static_cast<float>(size * size));
  return column;
}

// Fluid of the sizes 1 and 3 that fills the lower part of a turned tank: half of its area has large
// particles.
struct FilledTank {
  static constexpr double kWidth = 40, kDepth = 24;
  WallFrame frame;
  Particles particles;

  explicit FilledTank(std::uint64_t seed) : FilledTank(Random(seed)) {}

  Wall Walls() const {
    Particles corners;
    frame.Add(0, 99, corners);
    frame.Add(0, 0, corners);
    frame.Add(kWidth, 0, corners);
    frame.Add(kWidth, 99, corners);
    return {corners.xy};
  }
  Body Fluid() const {
    return {[this](double x, double y) {
              const double a = frame.A(x, y), w = frame.W(x, y);
              return std::max({-a, a - kWidth, -w, w - kDepth});
            },
            60};
  }

 private:
  explicit FilledTank(Random random) : frame(random) {
    const auto draw = [](Random& of, double, double) { return of.Chance(.1) ? 3.0 : 1.0; };
    particles = Shaken(Filled(Fluid(), random, draw), random, .05);
  }
};

ReconstructionParameters WithOwnSizes(std::vector<Wall> walls) {
  return {.spacing = 1.0, .sizes = Sizes::kOwn, .walls = std::move(walls)};
}

double LengthOfWetted(const Rings& rings) {
  double length = 0;
  for (const std::uint32_t k : rings.wetted) {
    const auto after = std::ranges::upper_bound(rings.offsets, k);
    const std::size_t next = k + 1 < *after ? k + 1 : *(after - 1);
    length += std::hypot(rings.points[2 * next] - rings.points[2 * std::size_t{k}],
                         rings.points[2 * next + 1] - rings.points[2 * std::size_t{k} + 1]);
  }
  return length;
}

// A lattice resolves gaps of a part of a cell only near its nodes, so sizes are at least 1.
TEST(SizedWalls, FluidTouchesWallsWithinHalfALocalSize) {
  for (const double size : {1.0, 2.0, 4.0, 6.0}) {
    SCOPED_TRACE(size);
    const double high = 12 * size;
    const Result near = ReconstructOnce(WithOwnSizes({kHighTank}), ColumnOfSize(size, .2 * size));
    const Result far = ReconstructOnce(WithOwnSizes({kHighTank}), ColumnOfSize(size, .7 * size));
    EXPECT_EQ(near.rings.contacts.size(), 2u);
    EXPECT_NEAR(LengthOfWetted(near.rings), kTankWidth + 2 * high, .5 * size);
    EXPECT_EQ(far.rings.contacts.size(), 4u);
    EXPECT_LT(LengthOfWetted(far.rings), 2 * high);
    EXPECT_NEAR(far.statistics.area, kTankWidth * high, .002 * kTankWidth * high);
  }
}

// With own sizes, equal particles have nearly the outline of equal sizes.
TEST(SizedWalls, EqualParticlesHaveTheOutlineOfEqualSizes) {
  const Particles column = ColumnOfSize(1, 0);
  ReconstructionParameters parameters = WithOwnSizes({kHighTank});
  const Rings own = ReconstructOnce(parameters, column).rings;
  parameters.sizes = Sizes::kEqual;
  const Rings equal = ReconstructOnce(parameters, column).rings;
  ASSERT_EQ(own.points.size(), equal.points.size());
  EXPECT_EQ(own.wetted, equal.wetted);
  EXPECT_EQ(own.contacts, equal.contacts);
  for (std::size_t k = 0; k < own.points.size(); ++k) {
    EXPECT_NEAR(own.points[k], equal.points[k], .01);
  }
}

TEST(SizedWalls, ATurnedTankOfMixedSizesIsFilled) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const FilledTank tank(seed);
    const Result result = ReconstructOnce(WithOwnSizes({tank.Walls()}), tank.particles);
    const Rings& rings = result.rings;
    EXPECT_TRUE(Validate(result).ok());
    ASSERT_EQ(rings.RingCount(), 1u);
    ASSERT_EQ(rings.contacts.size(), 2u);
    const auto& volumes = tank.particles.volumes;
    const double area = std::accumulate(volumes.begin(), volumes.end(), 0.0);
    const double depth = area / FilledTank::kWidth;
    EXPECT_NEAR(result.statistics.area, area, .001 * area);
    EXPECT_NEAR(LengthOfWetted(rings), FilledTank::kWidth + 2 * depth, 1);
    double lowest = 1e300, deviation = 0;
    int corners = 0, free = 0;
    for (std::size_t k = 0; k < rings.PointCount(); ++k) {
      const double a = tank.frame.A(rings.points[2 * k], rings.points[2 * k + 1]);
      const double w = tank.frame.W(rings.points[2 * k], rings.points[2 * k + 1]);
      lowest = std::min({lowest, a, FilledTank::kWidth - a, w});
      corners += std::hypot(std::min(a, FilledTank::kWidth - a), w) < 1e-9;
      if (w < FilledTank::kDepth / 2) continue;
      if (std::min(a, FilledTank::kWidth - a) < 1e-9) continue;
      deviation += std::abs(w - depth);
      ++free;
    }
    std::printf("wetted %.3f, surface %.3f off\n", LengthOfWetted(rings), deviation / free);
    EXPECT_GT(lowest, -1e-9);
    EXPECT_EQ(corners, 2);
    EXPECT_LT(deviation / free, .15);
  }
}

// Bodies of small particles may miss the floor on which they lie, but do not reach into it, unless
// the repair returns a point to its anchor.
TEST(SizedWalls, SmallBodiesStayAboveTheirFloor) {
  Random random(9);
  int behind = 0;
  for (int k = 0; k < support::Tries(300); ++k) {
    const double size = random.Uniform(.2, .9);
    const int columns = static_cast<int>(3 + random.Below(30));
    const int rows = static_cast<int>(3 + random.Below(20));
    Particles block = support::Scaled(support::Lattice(columns, rows, .5, .5), size);
    block = support::Shifted(block, random.Uniform(0, 1), 0);
    block = support::Jittered(block, random, .1 * size);
    block.volumes.assign(block.size(), static_cast<float>(size * size));
    const double floor = random.Uniform(0, 1);
    const Result result =
        ReconstructOnce(WithOwnSizes({{{0, floor, 1, floor}}}), support::Shifted(block, 0, floor));
    EXPECT_TRUE(Validate(result).ok());
    double lowest = floor;
    for (std::size_t p = 1; p < result.rings.points.size(); p += 2) {
      lowest = std::min(lowest, result.rings.points[p]);
    }
    behind += lowest < floor - 1e-6;
  }
  EXPECT_LE(behind, support::Tries(300) / 100);
}

TEST(SizedWalls, ResultsKeepTheGuaranteesInRandomFrames) {
  std::size_t contacts = 0, beyond = 0, points = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(1'000u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const double ratio = random.Chance(.5) ? 3 : 10;
    Particles particles = support::RandomSizes(seed, ratio == 3 ? .5 : .4, ratio);
    ReconstructionParameters parameters = WithOwnSizes(support::RandomWalls(random, particles));
    parameters.fill = AllFills()[seed % AllFills().size()];
    if (random.Chance(.2)) parameters.cell_size = random.Uniform(.5, 1.5);
    if (random.Chance(.3)) {
      parameters.wall_phases = {2};
      for (std::size_t k = 0; k < particles.size(); ++k) {
        particles.phases.push_back(random.Chance(.01) || particles.x(k) < particles.x(0) ? 2 : 1);
      }
      if (random.Chance(.5)) parameters.walls.clear();
      if (parameters.walls.empty() && random.Chance(.5)) {
        const double length = random.Uniform(50, 90);
        parameters.box = PeriodicBox{.axes = {PeriodicAxis{0, length}, {}, {}}};
      }
    }
    const Result result = ReconstructOnce(parameters, particles);
    const absl::Status status = Validate(result, parameters.fill);
    ASSERT_TRUE(status.ok()) << status;
    contacts += result.rings.contacts.size();
    points += result.rings.PointCount();
    for (std::size_t k = 0; k < result.rings.PointCount(); ++k) {
      const double x = result.rings.points[2 * k], y = result.rings.points[2 * k + 1];
      beyond += std::ranges::any_of(parameters.walls, [&](const Wall& wall) {
        return support::HeightAbove(wall, x, y) < -1e-6;
      });
    }
  }
  std::printf("%zu points, %zu beyond a wall, %zu contacts\n", points, beyond, contacts);
  EXPECT_GT(contacts, support::Tries(500u));
  EXPECT_LE(beyond, points / 50'000);
}

TEST(SizedWalls, AnyNumberOfThreadsAndAnyInstructionSetGivesTheSameBits) {
  const FilledTank tank(3);
  const ReconstructionParameters parameters = WithOwnSizes({tank.Walls()});
  const Result expected = ReconstructOnce(parameters, tank.particles);
  for (const std::size_t threads : {1u, 2u, 7u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(ReconstructOnce(parameters, tank.particles), expected);
  }
  support::ForEachInstructionSet(
      [&] { EXPECT_EQ(ReconstructOnce(parameters, tank.particles), expected); });
}

// Walls of two layers of smaller particles.
TEST(SizedWalls, WallParticlesMayHaveAnotherSize) {
  Particles particles = ColumnOfSize(1, 0);
  const std::size_t fluid = particles.size();
  constexpr double kSize = .75;
  constexpr int kColumns = 32, kLayers = 2;  // kColumns * kSize = kTankWidth.
  for (int i = -kLayers; i < kColumns + kLayers; ++i) {
    for (int j = -kLayers; j < 20; ++j) {
      if (i < 0 || i >= kColumns || j < 0) particles.Add((i + .5) * kSize, (j + .5) * kSize);
    }
  }
  particles.volumes.resize(particles.size(), static_cast<float>(kSize * kSize));
  particles.phases.assign(fluid, 1);
  particles.phases.resize(particles.size(), 2);
  ReconstructionParameters parameters = WithOwnSizes({});
  parameters.wall_phases = {2};
  const Result result = ReconstructOnce(parameters, particles);
  const Rings& rings = result.rings;
  ASSERT_EQ(rings.contacts.size(), 2u);
  EXPECT_NEAR(result.statistics.area, kTankWidth * 12, .5);
  for (const std::uint32_t k : rings.wetted) {
    const double x = rings.points[2 * std::size_t{k}], y = rings.points[2 * std::size_t{k} + 1];
    EXPECT_LT(std::abs(std::min({x, kTankWidth - x, y})), .1) << x << ", " << y;
  }
  // A size that is refused has the caller's number.
  for (const std::size_t k : {std::size_t{3}, particles.size() - 2}) {
    Particles wrong = particles;
    wrong.volumes[k] = 400;
    const auto violation = support::RefusalOf(parameters, wrong);
    ASSERT_TRUE(violation.has_value());
    EXPECT_EQ(violation->field, "volumes[" + std::to_string(k) + "]");
  }
}

// A layer on a floor of a box that is periodic along x, with an obstacle and wall particles across
// the face or in the middle of the box.
TEST(SizedWalls, LayersInABoxAreTheSameAcrossItsFaces) {
  constexpr double kLength = 48;
  Random random(5);
  Particles layer;
  for (double y = .5; y < 12; ++y) {
    for (double x = .5; x < kLength; ++x) {
      if (std::hypot(x - 24, y - 6) < 4) continue;
      const double dx = random.Uniform(-.05, .05);
      layer.Add(x + dx, y + random.Uniform(-.05, .05));
      layer.volumes.push_back(static_cast<float>(random.Uniform(.7, 1.3)));
    }
  }
  std::vector<Result> results;
  for (const double shift : {0.0, 24.0}) {
    ReconstructionParameters parameters =
        WithOwnSizes({{{0, 0, 1, 0}}, support::PolygonWall(24 + shift, 6, 3.2, 24, .1, false)});
    parameters.box = PeriodicBox{.axes = {PeriodicAxis{0, kLength}, {}, {}}};
    results.push_back(ReconstructOnce(parameters, support::Shifted(layer, shift, 0)));
    EXPECT_TRUE(Validate(results.back()).ok());
  }
  EXPECT_GT(results[0].rings.wetted.size(), 40u);
  EXPECT_NEAR(results[0].statistics.area, results[1].statistics.area, .05);
  EXPECT_NEAR(LengthOfWetted(results[0].rings), LengthOfWetted(results[1].rings), .01);
}

}  // namespace
}  // namespace partiemc
